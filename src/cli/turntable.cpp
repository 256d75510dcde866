#include "cli/turntable.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "base/files.hpp"
#include "base/hash.hpp"
#include "base/log.hpp"
#include "cli/developing.hpp"
#include "cli/render_monitor.hpp"
#include "cli/report.hpp"
#include "cli/stop_signal.hpp"
#include "cli/values.hpp"
#include "cli/view.hpp"

namespace raypager {
namespace {

using Json = nlohmann::ordered_json;

struct Turning {
    Camera first;
    std::array<double, 3> center, upright;
};

// What the scene shows, without what of it is backdrop.
std::vector<Box> shown_boxes(const Blocks& scene) {
    std::vector<Box> boxes;
    const auto scene_lower = scene.lower(), scene_upper = scene.upper();
    for (uint32_t i = 0; i < scene.count(); i++) {
        const auto [lower, upper] = scene.bounds(i);
        Box box;
        bool empty = false;
        for (size_t a = 0; a < 3; a++) {
            box.lower[a] = std::max(lower[a], scene_lower[a]);
            box.upper[a] = std::min(upper[a], scene_upper[a]);
            empty = empty || box.lower[a] > box.upper[a];
        }
        if (!empty) boxes.push_back(box);
    }
    return boxes;
}

// A camera that was given stays where it is; any other one moves back, if the scene would not fit into the pictures from all around.
Turning turning_of(const RenderSettings& settings, const RenderOptions& options, const Blocks& scene) {
    const Camera camera = options.camera.value_or(scene.camera());
    const auto center = center_of(scene);
    if (settings.camera) return {camera, center, settings.camera->up};
    const auto upright = upright_axis(camera);
    return {stand_back_for_turns(camera, center, upright, settings.turntable, shown_boxes(scene)), center, upright};
}

bool same_place(const Camera& a, const Camera& b) { return a.eye == b.eye && a.forward == b.forward; }

// Turning and moving round; the camera is to be one that the report can name to the last bit.
Camera as_printed(const Camera& camera, uint32_t width, uint32_t height) {
    const auto text = describe_camera(camera, width, height);
    const auto made = text ? make_camera(*text, width, height) : std::nullopt;
    return made.value_or(camera);
}

// One picture of them. What its denoising took is added to denoise_seconds.
Result<RenderResult> render_one(const RenderSettings& settings, RenderOptions options, const Blocks& file, const std::string& which,
                                double& denoise_seconds) {
    auto monitor = RenderMonitor::create(settings, options, std::nullopt);
    if (!monitor) return monitor.status();
    const RenderCallbacks callbacks = monitor->callbacks(options);
    auto result = render(file, options, callbacks);
    progress_line("");
    if (!result) return result.status();
    // An empty picture must not take the place of an older one.
    if (!result->report.complete && result->report.average_spp == 0) return result;
    const auto denoised = denoise_picture(settings, result->image, result->layers);
    expose(result->image, settings.exposure);
    RAYPAGER_TRY(write_picture(settings, result->image, result->layers));
    if (!denoised) return denoised.status().at(settings.output.string() + " is the picture with its noise");
    denoise_seconds += *denoised;
    const std::string unfinished = result->report.complete ? "" : fmt::format(", stopped at {:.1f} samples per pixel", result->report.average_spp);
    log_note(fmt::format("picture {}: {}, {}{}", which, settings.output.string(), format_duration(result->report.seconds.total), unfinished));
    return result;
}

Json picture_json(const RenderSettings& settings, const RenderOptions& options, const Blocks& scene, const RenderReport& report) {
    return {{"output", settings.output.string()},
            {"camera", camera_json(*options.camera, report.width, report.height, scene)},
            {"film_hash", hex64(report.film_hash)},
            {"seconds", report.seconds.total}};
}

}  // namespace

std::filesystem::path turntable_picture(const std::filesystem::path& output, uint32_t index, uint32_t count) {
    const int digits = count > 1000 ? 4 : 3;
    return output.parent_path() / fmt::format("{}_{:0{}}{}", output.stem().string(), index, digits, output.extension().string());
}

Status render_turntable(const RenderSettings& settings, const RenderOptions& options, const OpenedScene& opened,
                        std::chrono::steady_clock::time_point begin) {
    const Blocks& scene = opened.blocks;
    const Turning turning = turning_of(settings, options, scene);
    const StopSignal signal(StopMode::keep);
    const std::atomic<bool>& stopped = signal.stop();
    RenderSettings one = settings;
    RenderOptions turned = options;
    turned.stop = &stopped;
    turned.stop_now = &signal.stop_now();
    Json pictures = Json::array();
    std::optional<RenderReport> last;
    uint32_t finished = 0;
    double denoise_seconds = 0;
    for (uint32_t i = 0; i < settings.turntable && !stopped; i++) {
        one.output = turntable_picture(settings.output, i, settings.turntable);
        turned.camera = turned_camera(turning.first, turning.center, turning.upright, static_cast<double>(i) / settings.turntable);
        if (!same_place(*turned.camera, options.camera.value_or(scene.camera())))
            turned.camera = as_printed(*turned.camera, turned.width, turned.height);
        const auto result = render_one(one, turned, opened.blocks, fmt::format("{} of {}", i + 1, settings.turntable), denoise_seconds);
        if (!result && stopped) break;  // compilers of kernels, too, end at signals, as if there were an error
        if (!result) return result.status();
        if (!result->report.complete && result->report.average_spp == 0) break;  // of which there is no picture
        finished += result->report.complete;
        last = result->report;
        pictures.push_back(picture_json(one, turned, scene, *last));
    }
    if (settings.report && last) {
        const ReportSeconds seconds{std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count(), opened.bake_seconds,
                                    denoise_seconds};
        Json report = report_json(settings, turned, scene, *last, seconds);
        report["turntable"] = pictures;
        RAYPAGER_TRY(write_text(*settings.report, json_text(report)));
    }
    if (finished == settings.turntable) return {};
    return Status::interrupted(fmt::format("stopped by a signal after {} of {} pictures{}", finished, settings.turntable,
                                           pictures.size() > finished ? fmt::format("; {} is not finished", one.output.string()) : ""));
}

}  // namespace raypager
