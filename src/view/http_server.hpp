// A web server for one page in one browser on the same machine: bound to 127.0.0.1, answers whoever knows the token in its URL and comes from its own
// page (request_check.hpp). Keeps Boost.Beast in one file.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "raypager/status.hpp"

namespace raypager {

struct HttpRequest {
    bool post = false;  // else GET
    std::string name;   // behind the token; empty: the page itself
    std::map<std::string, std::string> query;
    std::string body;
};

struct HttpReply {
    unsigned status = 200;
    std::string type = "text/plain; charset=utf-8";
    std::string body;
    std::vector<std::pair<std::string, std::string>> headers = {};
};
HttpReply json_reply(std::string text, unsigned status = 200);

class HttpServer {
public:
    // Takes the reply, from any thread, once; where it is never called, the browser waits.
    using Respond = std::function<void(HttpReply reply)>;
    using Handle = std::function<void(HttpRequest request, Respond respond)>;

    // handle is called from the server's one thread, and must not take long. port 0: one that is free. A port that is taken is an error.
    static Result<std::unique_ptr<HttpServer>> start(uint16_t port, Handle handle);
    ~HttpServer();  // breaks off what is under way
    HttpServer(const HttpServer&) = delete;
    HttpServer& operator=(const HttpServer&) = delete;

    uint16_t port() const;
    std::string url() const;  // with the token

    // What is read of a request at most, and how long that may take.
    static constexpr uint32_t max_header_bytes = 16 << 10, max_body_bytes = 16 << 10;
    static constexpr int max_connections = 32, request_seconds = 10, idle_seconds = 60;

private:
    class Implementation;
    explicit HttpServer(std::unique_ptr<Implementation> implementation);
    std::unique_ptr<Implementation> implementation_;
};

}  // namespace raypager
