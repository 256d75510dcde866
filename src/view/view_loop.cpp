#include "view/view_loop.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "raypager/film_layers.hpp"
#include "view/block_map.hpp"
#include "view/page_files.hpp"
#include "view/picture_bytes.hpp"

namespace raypager {
namespace {

using Json = nlohmann::ordered_json;

constexpr size_t most_tasks = 64;
constexpr double step_seconds = 0.02;
// Pictures cost time that the render does not get: afterwards, so many times as much goes by before the next one. While a view is young, it is the
// looking that counts.
constexpr double young_seconds = 1, pause_while_young = 4, pause = 32, least_pause = 0.05;
constexpr auto patience = std::chrono::seconds(5);  // of who waits for a picture; then the page asks again, so that those who have gone are noticed
constexpr double preview_pixels = 60000;            // while the camera moves
// The first picture of a view comes when so many samples are finished, or after this time if there are some at all.
constexpr double many_samples = 12000, some_samples = 300;
constexpr double first_picture_seconds = 0.2;

double seconds_between(std::chrono::steady_clock::time_point from, std::chrono::steady_clock::time_point to) {
    return std::chrono::duration<double>(to - from).count();
}

std::string text_of(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }
HttpReply error_reply(const std::string& message, unsigned status) { return json_reply(text_of({{"error", message}}), status); }
HttpReply gone_reply() { return error_reply("the view has ended", 503); }

bool is_for_session(const HttpRequest& request) {
    static constexpr std::string_view asked[] = {"picture", "blocks", "pick", "save"}, told[] = {"camera", "limit"};
    return request.post ? std::find(std::begin(told), std::end(told), request.name) != std::end(told)
                        : std::find(std::begin(asked), std::end(asked), request.name) != std::end(asked);
}

std::string describe_view(const Camera& camera, uint32_t width, uint32_t height, const Blocks& scene) {
    std::array<double, 3> center;
    for (size_t a = 0; a < 3; a++) center[a] = 0.5 * (double{scene.lower()[a]} + scene.upper()[a]);
    return camera_string(camera, width, height, center);
}

// Layers of one value by their names; null what is infinite.
Json json_of(const std::vector<FilmLayerImage>& layers) {
    Json json = Json::object();
    for (const FilmLayerImage& layer : layers) {
        if (layer.image.values.size() != 1) continue;
        const float value = layer.image.values.front();
        json[std::string(film_layer_name(layer.layer))] = std::isfinite(value) ? Json(value) : Json(nullptr);
    }
    return json;
}

}  // namespace

RenderOptions options_for_view(const Blocks& scene, RenderOptions options) {
    options.coarse_first = true;
    for (const FilmLayer layer : {FilmLayer::depth, FilmLayer::material, FilmLayer::samples}) options.layers.add(layer);
    if (scene.instances() > 0)
        for (const FilmLayer layer : {FilmLayer::object, FilmLayer::instance}) options.layers.add(layer);
    return options;
}

ViewLoop::ViewLoop(const Blocks& scene, const RenderOptions& options, ViewSettings settings)
    : scene_(scene),
      options_(options),
      settings_(std::move(settings)),
      width_(options.width),
      height_(options.height),
      camera_(options.camera.value_or(scene.camera())),
      camera_text_(describe_view(camera_, width_, height_, scene)),
      limit_{options.geometry_limit, options.geometry_limit_percent},
      state_(text_of({{"phase", "starting"}, {"title", settings_.title}, {"width", width_}, {"height", height_}})) {}

void ViewLoop::handle(HttpRequest request, HttpServer::Respond respond) {
    const PageFile* file = request.post ? nullptr : find_page_file(request.name);
    if (file) return respond({200, type_of_page_file(file->name), std::string(file->text)});
    std::unique_lock lock(mutex_);
    if (!request.post && request.name == "state") {
        HttpReply reply = closed_ ? gone_reply() : json_reply(state_);
        lock.unlock();
        return respond(std::move(reply));
    }
    if (closed_ || tasks_.size() >= most_tasks || !is_for_session(request)) {
        const HttpReply reply = closed_                    ? gone_reply()
                                : !is_for_session(request) ? error_reply("nothing here", 404)
                                                           : error_reply("too many requests at once", 503);
        lock.unlock();
        return respond(reply);
    }
    tasks_.push_back({std::move(request), std::move(respond)});
    came_.notify_one();
}

std::vector<ViewLoop::Task> ViewLoop::take_tasks(bool wait) {
    std::unique_lock lock(mutex_);
    if (wait) came_.wait_for(lock, std::chrono::milliseconds(50), [this] { return !tasks_.empty(); });
    std::vector<Task> tasks(std::make_move_iterator(tasks_.begin()), std::make_move_iterator(tasks_.end()));
    tasks_.clear();
    return tasks;
}

Status ViewLoop::run(Session& session, const std::function<bool()>& ended) {
    view_begin_ = Clock::now();
    while (!ended()) {
        RAYPAGER_TRY(serve(session, take_tasks(session.done())));
        if (!session.done()) RAYPAGER_TRY(session.step(step_seconds));
        const auto now = Clock::now();
        meter_.add(seconds_between({}, now), session.progress());
        write_state(session);
        if (picture_is_due(session)) RAYPAGER_TRY(take_picture(session));
        let_go_of_late(now);
    }
    return {};
}

void ViewLoop::close() {
    std::vector<Task> tasks;
    {
        const std::lock_guard lock(mutex_);
        closed_ = true;
        tasks.assign(std::make_move_iterator(tasks_.begin()), std::make_move_iterator(tasks_.end()));
        tasks_.clear();
    }
    for (const Task& task : tasks) task.respond(gone_reply());
    for (const Waiting& looker : std::exchange(lookers_, {})) looker.respond(gone_reply());
    for (const auto& respond : std::exchange(movers_, {})) respond(gone_reply());
}

Status ViewLoop::serve(Session& session, std::vector<Task> tasks) {
    for (Task& task : tasks) RAYPAGER_TRY(serve_one(session, task));
    return wanted_ ? move(session) : Status();
}

Status ViewLoop::serve_one(Session& session, Task& task) {
    const std::string& name = task.request.name;
    if (name == "picture")
        take_picture_request(task);
    else if (name == "blocks")
        send_blocks(session, task);
    else if (name == "camera")
        take_camera(task);
    else if (name == "limit")
        return change_limit(session, task);
    else if (name == "pick")
        return pick(session, task);
    else
        return save(session, task);
    return {};
}

void ViewLoop::take_picture_request(Task& task) {
    if (picture_.number > 0 && picture_.number != parse_after(task.request.query)) return task.respond(picture_reply());
    lookers_.push_back({std::move(task.respond), Clock::now()});
}

void ViewLoop::let_go_of_late(Clock::time_point now) {
    std::erase_if(lookers_, [&](const Waiting& looker) {
        if (now - looker.since < patience) return false;
        looker.respond({204, "text/plain", ""});
        return true;
    });
}

// Of several that came meanwhile, the last counts.
void ViewLoop::take_camera(Task& task) {
    if (!settings_.camera_moves) return task.respond(error_reply("this render is for a file: its camera stays", 409));
    const auto command = parse_camera_command(task.request.body);
    if (!command) return task.respond(error_reply(command.status().message(), 400));
    if (!make_camera(command->camera, options_.width, options_.height)) return task.respond(error_reply("the camera has no direction", 400));
    wanted_ = *command;
    movers_.push_back(std::move(task.respond));
}

Status ViewLoop::move(Session& session) {
    const CameraCommand command = *std::exchange(wanted_, std::nullopt);
    const double pixels = static_cast<double>(options_.width) * options_.height;
    const auto divisor = command.moving ? static_cast<uint32_t>(std::max(1.0, std::ceil(std::sqrt(pixels / preview_pixels)))) : 1u;
    SessionView view;
    view.width = std::max(1u, options_.width / divisor);
    view.height = std::max(1u, options_.height / divisor);
    view.camera = make_camera(command.camera, view.width, view.height);
    const Status status = view.camera ? session.restart(view) : Status::usage("the camera has no direction");
    const auto movers = std::exchange(movers_, {});
    if (!status) {
        for (const auto& respond : movers) respond(error_reply(status.message(), 400));
        return status.kind() == ErrorKind::usage ? Status() : status;
    }
    width_ = view.width;
    height_ = view.height;
    camera_ = *view.camera;
    camera_text_ = format_camera(command.camera);
    view_++;
    view_begin_ = next_picture_ = Clock::now();
    meter_.begin_anew();
    write_state(session);
    for (const auto& respond : movers) respond(json_reply(text_of({{"view", view_}})));
    return {};
}

// The view goes on.
Status ViewLoop::refuse(const Task& task, const Status& why, unsigned code) {
    task.respond(error_reply(why.message(), code));
    return {};
}

Status ViewLoop::change_limit(Session& session, Task& task) {
    const auto command = parse_limit_command(task.request.body);
    if (!command) return refuse(task, command.status(), 400);
    const Status status = session.limit_geometry(command->bytes, command->percent);
    if (!status) {
        RAYPAGER_TRY(refuse(task, status, 400));
        return status.kind() == ErrorKind::usage ? Status() : status;
    }
    limit_ = *command;
    meter_.begin_anew();
    write_state(session);
    task.respond(json_reply("{}"));
    return {};
}

// x and y are of the whole picture, also while a smaller one is shown.
Status ViewLoop::pick(Session& session, Task& task) {
    const auto pixel = parse_pixel_query(task.request.query, options_.width, options_.height);
    if (!pixel) return refuse(task, pixel.status(), 400);
    const auto scaled = [](uint32_t at, uint32_t from, uint32_t to) { return static_cast<uint32_t>(uint64_t{at} * to / from); };
    const uint32_t x = scaled(pixel->x, options_.width, width_), y = scaled(pixel->y, options_.height, height_);
    Json json;
    // Of the points that come first, one is near.
    for (uint32_t apart = 1; apart <= 8; apart *= 2) {
        const auto layers = session.layers_at(x / apart * apart, y / apart * apart);
        if (!layers) return layers.status();
        json = json_of(*layers);
        if (!json.contains("samples") || json["samples"] > 0) break;
    }
    task.respond(json_reply(text_of(json)));
    return {};
}

Status ViewLoop::save(Session& session, Task& task) {
    const auto query = parse_save_query(task.request.query);
    if (!query) return refuse(task, query.status(), 400);
    auto image = session.snapshot();
    if (!image) return image.status();
    expose(*image, query->exposure);
    auto contents = file_contents(*image, query->ending);
    if (!contents) return refuse(task, contents.status(), 500);
    const std::string type = query->ending == ".png" ? "image/png" : "image/x-exr";
    const std::string disposition = fmt::format("attachment; filename=\"raypager{}\"", query->ending);
    task.respond({200, type, std::move(*contents), {{"Content-Disposition", disposition}}});
    return {};
}

void ViewLoop::send_blocks(const Session& session, Task& task) const {
    const auto status = session.blocks();
    const auto shown = blocks_to_show(scene_, status, {camera_.eye.x, camera_.eye.y, camera_.eye.z}, most_blocks_shown);
    task.respond({200, "application/octet-stream", block_records(scene_, status, shown)});
}

// Nobody looks, no picture.
bool ViewLoop::picture_is_due(const Session& session) const {
    if (lookers_.empty()) return false;
    if (Clock::now() < next_picture_) return false;
    if (picture_.view == view_) return !picture_.last;
    const double pixels = static_cast<double>(width_) * height_, finished = session.progress().finished_spp * pixels;
    if (session.done() || finished >= std::min(pixels, many_samples)) return true;
    const double seconds = seconds_between(view_begin_, Clock::now());
    return (seconds > first_picture_seconds && finished >= some_samples) || (seconds > 4 * first_picture_seconds && finished > 0);
}

Status ViewLoop::take_picture(Session& session) {
    const auto begin = Clock::now();
    const bool last = session.done();
    double spp = 0;
    const auto image = session.snapshot(&spp);
    if (!image) return image.status();
    if (spp == 0 && !last) {
        next_picture_ = begin + std::chrono::milliseconds(20);
        return {};
    }
    picture_ = {picture_.number + 1, view_, image->width, image->height, spp, last, half_pixels(*image)};
    for (const Waiting& looker : std::exchange(lookers_, {})) looker.respond(picture_reply());
    const auto end = Clock::now();
    const bool young = seconds_between(view_begin_, end) < young_seconds;
    const double wait = std::max(least_pause, seconds_between(begin, end) * (young ? pause_while_young : pause));
    next_picture_ = end + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(wait));
    return {};
}

HttpReply ViewLoop::picture_reply() const {
    const Json about = {{"number", picture_.number}, {"view", picture_.view}, {"width", picture_.width},
                        {"height", picture_.height}, {"spp", picture_.spp},   {"last", picture_.last}};
    return {200, "application/octet-stream", picture_.pixels, {{"Raypager-Picture", text_of(about)}}};
}

void ViewLoop::write_state(const Session& session) {
    const RenderProgress p = session.progress();
    const ViewRates rates = meter_.rates();
    const Json json = {{"phase", session.done() ? "finished" : "rendering"},
                       {"title", settings_.title},
                       {"view", view_},
                       {"width", options_.width},
                       {"height", options_.height},
                       {"preview", width_ != options_.width || height_ != options_.height},
                       {"spp", p.spp},
                       {"of_spp", options_.spp},
                       {"seconds", p.seconds},
                       {"rays", p.rays},
                       {"loads", p.loads},
                       {"bytes_loaded", p.bytes_loaded},
                       {"rays_per_second", rates.rays},
                       {"loads_per_second", rates.loads},
                       {"bytes_per_second", rates.bytes},
                       {"resident_bytes", p.resident_bytes},
                       {"pool_bytes", p.pool_bytes},
                       {"geometry_bytes", p.geometry_bytes},
                       {"blocks", scene_.count()},
                       {"blocks_of_objects", scene_.first_block_in_world()},
                       {"limit", {{"bytes", limit_.bytes}, {"percent", limit_.percent}}},
                       {"camera", camera_text_},
                       {"camera_moves", settings_.camera_moves && !camera_text_.empty()},
                       {"exposure", settings_.exposure},
                       {"bounds", {{"min", scene_.lower()}, {"max", scene_.upper()}}}};
    std::string text = text_of(json);
    const std::lock_guard lock(mutex_);
    state_ = std::move(text);
}

}  // namespace raypager
