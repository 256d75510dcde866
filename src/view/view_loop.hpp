// Between the page and a render: takes the page's requests on the server's thread, and does what they ask on the thread that owns the session,
// between two of its rounds.
#pragma once

#include <chrono>
#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "raypager/blocks.hpp"
#include "raypager/camera_text.hpp"
#include "raypager/session.hpp"
#include "raypager/status.hpp"
#include "view/commands.hpp"
#include "view/http_server.hpp"
#include "view/view_rates.hpp"

namespace raypager {

struct ViewSettings {
    std::string title;         // what is looked at
    double exposure = 0;       // stops, to begin with
    bool camera_moves = true;  // false: a render for a file, which is watched
};

// The options of a session that is looked at: what the film must keep, and in which order samples begin. layers: for who clicks.
RenderOptions options_for_view(const Blocks& scene, RenderOptions options);

class ViewLoop {
public:
    // options: of the session, with size and camera.
    ViewLoop(const Blocks& scene, const RenderOptions& options, ViewSettings settings);
    // From the server's thread, at any time.
    void handle(HttpRequest request, HttpServer::Respond respond);
    // Steps the session and serves the page until ended() says so, which is asked between two rounds. What is done stays open to be looked at.
    // An error of the session ends it.
    Status run(Session& session, const std::function<bool()>& ended);
    // Answers all who wait, and those who still ask: there is nothing to see any more.
    void close();

private:
    using Clock = std::chrono::steady_clock;
    struct Task {
        HttpRequest request;
        HttpServer::Respond respond;
    };
    struct Waiting {
        HttpServer::Respond respond;
        Clock::time_point since;
    };

    std::vector<Task> take_tasks(bool wait);
    Status serve(Session& session, std::vector<Task> tasks);
    Status serve_one(Session& session, Task& task);
    static Status refuse(const Task& task, const Status& why, unsigned code);
    void take_picture_request(Task& task);
    void take_camera(Task& task);
    Status move(Session& session);
    Status change_limit(Session& session, Task& task);
    Status pick(Session& session, Task& task);
    Status save(Session& session, Task& task);
    void send_blocks(const Session& session, Task& task) const;
    bool picture_is_due(const Session& session) const;
    Status take_picture(Session& session);
    HttpReply picture_reply() const;
    void let_go_of_late(Clock::time_point now);
    void write_state(const Session& session);

    const Blocks scene_;
    const RenderOptions options_;
    const ViewSettings settings_;

    // Of the thread that renders.
    uint32_t width_, height_;  // of the picture now: a smaller one while the camera moves
    Camera camera_;
    std::string camera_text_;
    LimitCommand limit_;
    std::optional<CameraCommand> wanted_;  // not shown yet
    std::vector<HttpServer::Respond> movers_;
    uint64_t view_ = 1;  // grows whenever the picture begins anew
    Clock::time_point view_begin_ = Clock::now();
    RateMeter meter_;
    std::vector<Waiting> lookers_;
    struct Picture {
        uint64_t number = 0, view = 0;
        uint32_t width = 0, height = 0;
        double spp = 0;
        bool last = false;  // nothing better will come
        std::string pixels;
    } picture_;
    Clock::time_point next_picture_ = Clock::now();

    std::mutex mutex_;
    std::condition_variable came_;
    std::deque<Task> tasks_;
    std::string state_;
    bool closed_ = false;
};

}  // namespace raypager
