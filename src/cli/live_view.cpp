#include "cli/live_view.hpp"

#include <fmt/format.h>

#ifdef RAYPAGER_VIEW
#include <fcntl.h>
#include <spawn.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <limits>

#include "base/log.hpp"
#include "cli/look_options.hpp"
#include "cli/scene_cache.hpp"
#include "cli/stop_signal.hpp"
#include "cli/values.hpp"
#include "cli/verbs.hpp"
#include "view/http_server.hpp"
#include "view/view_loop.hpp"
#endif

namespace raypager {

#ifdef RAYPAGER_VIEW
namespace {

constexpr uint32_t most_samples = 65535;  // which nobody will wait for

constexpr const char* about_view =
    "Shows a scene in a browser on this machine while it is rendered: the picture as it converges, with a camera that moves, the blocks that come "
    "and\n"
    "go, and what is at a pixel. The address is printed; it has a secret part that others would need. INPUT is what 'raypager render' takes. "
    "Without\n"
    "--spp and --time the picture gets better until Ctrl-C ends it, up to 65535 samples per pixel.";

struct LiveViewSettings {
    RenderSettings render;
    uint32_t port = 0;  // 0: one that is free
    bool open = false;
};

Result<std::optional<LiveViewSettings>> parse_live_view_settings(const Arguments& arguments) {
    LiveViewSettings settings;
    RenderSettings& render = settings.render;
    std::vector<std::string> inputs;
    OptionParser parser("view", "INPUT... [options]", about_view);
    parser.inputs("INPUT", 1, std::numeric_limits<size_t>::max(), inputs);
    parser.option("port", "N", "port of 127.0.0.1 that the page is at, 1 to 65535 (default: one that is free)", into_count(settings.port, 1, 65535));
    parser.flag("open",
                "open the page in the browser that xdg-open finds; other users of this machine may then see the address in the list of processes",
                settings.open);
    add_picture_options(parser, render);
    add_look_options(parser, render.look, render.texts);
    add_exposure_options(parser, render);
    add_device_options(parser, render);
    add_paging_options(parser, render);
    add_baking_options(parser, render);
    parser.flag("progress", "show the progress of baking even if stderr is not a terminal", render.progress);
    add_tuning_options(parser, render);
    const auto outcome = parser.parse(arguments);
    if (!outcome) return outcome.status();
    if (*outcome == OptionParser::Outcome::help_shown) return std::optional<LiveViewSettings>();
    render.inputs.assign(inputs.begin(), inputs.end());
    RAYPAGER_TRY(check_inputs(parser, render));
    RAYPAGER_TRY(check_look_options(parser, render.look, render.inputs));
    if (render.options.spp == 0) render.options.spp = most_samples;
    return std::optional(std::move(settings));
}

std::string title_of(const std::vector<std::filesystem::path>& inputs) {
    const std::string first = inputs.front().filename().string();
    return inputs.size() == 1 ? first : fmt::format("{} and {} more", first, inputs.size() - 1);
}

// For whoever starts it, or a script: one line.
void print_address(const HttpServer& server) {
    std::fputs((server.url() + "\n").c_str(), stdout);
    std::fflush(stdout);
}

void open_browser(const std::string& url) {
    std::string program = "xdg-open", address = url;
    char* const arguments[] = {program.data(), address.data(), nullptr};
    // In a session of its own, so that Ctrl-C does not end the browser; and what it prints is not for those who read the address.
    posix_spawn_file_actions_t files;
    posix_spawnattr_t attributes;
    posix_spawn_file_actions_init(&files);
    posix_spawnattr_init(&attributes);
    posix_spawn_file_actions_addopen(&files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSID);
    pid_t id;
    if (posix_spawnp(&id, program.c_str(), &files, &attributes, arguments, environ) != 0)
        log_warning("--open: xdg-open cannot be started; open the address by hand");
    posix_spawnattr_destroy(&attributes);
    posix_spawn_file_actions_destroy(&files);
}

Status show(const LiveViewSettings& settings, const Blocks& scene, const StopSignal& signal) {
    const auto effective = effective_options(settings.render, scene);
    if (!effective) return effective.status();
    const RenderOptions options = options_for_view(scene, *effective);
    ViewLoop loop(scene, options, {title_of(settings.render.inputs), settings.render.exposure, true});
    const auto server = HttpServer::start(static_cast<uint16_t>(settings.port), [&loop](HttpRequest request, HttpServer::Respond respond) {
        loop.handle(std::move(request), std::move(respond));
    });
    if (!server) return server.status().at("view");
    print_address(**server);
    if (settings.open) open_browser((*server)->url());
    auto session = Session::create(scene, options);
    if (signal.stop()) return {};  // compilers of kernels, too, end at signals, as if there were an error
    if (!session) return session.status();
    const Status status = loop.run(*session, [&signal] { return signal.stop().load(); });
    loop.close();
    return signal.stop() ? Status() : status;
}

}  // namespace

Status run_view(const Arguments& arguments) {
    const auto settings = parse_live_view_settings(arguments);
    if (!settings) return settings.status();
    if (!*settings) return {};
    const RenderSettings& render = (*settings)->render;
    const StopSignal signal(StopMode::leave);
    BakeRequest request = {
        render.bake, {render.options.width, render.options.height, render.camera}, render.progress || stderr_is_terminal(), render.look};
    if (render.options.host_limit) request.options.host_limit = std::max(render.options.host_limit, smallest_bake_limit(request.options.block_bytes));
    const auto opened = open_scene(render.inputs, render.cache_directory, request);
    if (!opened) return opened.status();
    signal.set_mode(StopMode::finish);
    return show(**settings, opened->blocks, signal);
}

Result<RenderResult> render_in_view(const RenderSettings& settings, const Blocks& scene, const RenderOptions& options,
                                    const RenderCallbacks& callbacks) {
    RenderOptions seen = options;
    seen.coarse_first = true;
    ViewLoop loop(scene, seen, {title_of(settings.inputs), settings.exposure, false});
    const auto server =
        HttpServer::start(0, [&loop](HttpRequest request, HttpServer::Respond respond) { loop.handle(std::move(request), std::move(respond)); });
    if (!server) return server.status().at("--view");
    print_address(**server);
    auto session = Session::create(scene, seen, callbacks);
    if (!session) return session.status();
    const Status status = loop.run(*session, [&session] { return session->done(); });
    loop.close();
    if (!status) return status;
    return session->finish();
}
#else
Result<RenderResult> render_in_view(const RenderSettings&, const Blocks&, const RenderOptions&, const RenderCallbacks&) {
    return Status::usage("--view: this program was built without it");
}
#endif

}  // namespace raypager
