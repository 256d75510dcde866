#include <fmt/format.h>

#include <chrono>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "base/files.hpp"
#include "base/log.hpp"
#include "cli/developing.hpp"
#include "cli/live_view.hpp"
#include "cli/output_paths.hpp"
#include "cli/ranks.hpp"
#include "cli/render_monitor.hpp"
#include "cli/render_settings.hpp"
#include "cli/report.hpp"
#include "cli/scene_cache.hpp"
#include "cli/stop_signal.hpp"
#include "cli/turntable.hpp"
#include "cli/values.hpp"
#include "cli/verbs.hpp"
#include "raypager/baselines.hpp"
#include "raypager/session.hpp"

namespace raypager {
namespace {

// Everything that can be known to fail is found before the first mesh is read.
Status check_outputs(const RenderSettings& settings) {
    const auto picture = settings.turntable > 0 ? turntable_picture(settings.output, 0, settings.turntable) : settings.output;
    RAYPAGER_TRY(check_output_path(picture));
    RAYPAGER_TRY(check_writable_image(picture));
    if (settings.options.layers.any() && !holds_layers(picture))
        return Status::usage(fmt::format("--layers: {} has no room for them; name an .exr file", picture.string()));
    if (settings.log) RAYPAGER_TRY(check_output_path(*settings.log));
    if (settings.report) RAYPAGER_TRY(check_output_path(*settings.report));
    if (const auto& checkpoint = settings.options.checkpoint.file; !checkpoint.empty()) RAYPAGER_TRY(check_output_path(checkpoint));
    if (const auto& trace = settings.options.record.file; !trace.empty()) RAYPAGER_TRY(check_output_path(trace));
    return {};
}

// Before the scene is read, for a missing file should not cost a bake.
Result<std::optional<Image>> read_reference(const RenderSettings& settings) {
    if (!settings.reference) return std::optional<Image>();
    auto image = read_image(*settings.reference);
    if (!image) return image.status().at("--reference");
    return std::optional(std::move(*image));
}

Status write_results(const RenderSettings& settings, const RenderOptions& effective, const Blocks& scene, const RenderResult& result,
                     const ReportSeconds& seconds) {
    RAYPAGER_TRY(write_picture(settings, result.image, result.layers));
    if (const auto& trace = effective.record.file; !trace.empty() && result.report.complete)
        log_note(fmt::format("demand trace: {}, {} of {} paths", trace.string(), format_count(result.report.recorded_paths),
                             format_count(result.report.rays.camera)));
    if (!settings.report) return {};
    return write_text(*settings.report, json_text(report_json(settings, effective, scene, result.report, seconds)));
}

void print_summary(const RenderSettings& settings, const Blocks& scene, const RenderReport& report, const ReportSeconds& seconds,
                   std::optional<double> rmse, uint64_t ground) {
    std::fputs(summary_text(scene, report, seconds, ground).c_str(), stderr);
    if (rmse) log_note(fmt::format("RMSE against {}: {:.6g}", settings.reference->string(), *rmse));
    if (settings.report) log_note(fmt::format("report: {}", settings.report->string()));
    log_note(fmt::format("picture: {}", settings.output.string()));
}

// What a render that was stopped before its time has to say for itself.
Status stopped_early(const RenderSettings& settings, const RenderReport& report) {
    std::string what = fmt::format("stopped by a signal; the picture has {:.1f} samples per pixel", report.average_spp);
    const double pixels = static_cast<double>(report.width) * report.height;
    if (report.unsampled > 0)
        what += fmt::format(", and {} of its pixels, which have none yet, are filled in from those around them",
                            format_share(static_cast<double>(report.unsampled) / pixels));
    if (settings.options.checkpoint.file.empty()) return Status::interrupted(what);
    // The checkpoint matters most then: without a new one the work is lost, whatever the picture shows.
    if (report.checkpoint.advice.empty()) return Status::failed(what + "; no checkpoint could be written");
    return Status::interrupted(what + "; " + report.checkpoint.advice);
}

// All come to this together.
Status wait_for(Peers& peers) {
    std::vector<std::byte> nothing;
    return peers.broadcast(nothing);
}

// Rank 0 opens the scene, and bakes what is not baked.
Result<OpenedScene> open_for_all(const RenderSettings& settings, const BakeRequest& request) {
    Peers* const peers = settings.options.peers.get();
    std::optional<OpenedScene> opened;
    if (!peers || peers->rank() == 0) {
        auto scene = open_scene(settings.inputs, settings.cache_directory, request);
        if (!scene || !peers) return scene;
        opened = std::move(*scene);
    }
    auto blocks = Blocks::hand_out(opened ? std::optional(opened->blocks) : std::nullopt, *peers);
    if (!blocks) return blocks.status();
    return opened ? *opened : OpenedScene{*blocks};
}

// Of a render that rank 0 has the picture of.
Status render_for_others(const RenderOptions& options, const Blocks& scene, const StopSignal& signal, bool& together) {
    RenderCallbacks callbacks;
    callbacks.begins = [&signal] { signal.set_mode(StopMode::keep); };
    RAYPAGER_TRY(render(scene, options, callbacks).status());
    RAYPAGER_TRY(wait_for(*options.peers));  // while rank 0 writes, for signals come to all
    together = true;
    return {};
}

// together: whether all processes have come to its end.
Status render_to_files(const RenderSettings& settings, bool& together) {
    const auto begin = std::chrono::steady_clock::now();
    Peers* const peers = settings.options.peers.get();
    const bool reports = !peers || peers->rank() == 0;
    if (peers && (settings.turntable > 0 || settings.view))
        return Status::usage("--turntable and --view are for one process; start it without mpirun");
    if (reports) RAYPAGER_TRY(check_outputs(settings));
    const StopSignal signal(StopMode::leave);
    auto reference = reports ? read_reference(settings) : std::optional<Image>();
    if (!reference) return reference.status();
    const bool show_progress = reports && (settings.progress || stderr_is_terminal());
    BakeRequest request = {settings.bake, {settings.options.width, settings.options.height, settings.camera}, show_progress, settings.look};
    if (settings.options.host_limit)
        request.options.host_limit = std::max(settings.options.host_limit, smallest_bake_limit(request.options.block_bytes));
    const auto opened = open_for_all(settings, request);
    if (!opened) return opened.status();
    const Blocks& scene = opened->blocks;
    auto options = effective_options(settings, scene);
    if (!options) return options.status();
    if (settings.paper_preset)
        if (const auto difference = paper_bake_difference(scene)) log_note(*difference);
    if (settings.turntable > 0) return render_turntable(settings, *options, *opened, begin);
    options->stop = &signal.stop();
    options->stop_now = &signal.stop_now();
    if (!reports) return render_for_others(*options, scene, signal, together);
    auto monitor = RenderMonitor::create(settings, *options, std::move(*reference));
    if (!monitor) return monitor.status();

    RenderCallbacks callbacks = monitor->callbacks(*options);
    callbacks.begins = [&signal] { signal.set_mode(StopMode::keep); };
    auto result = settings.view ? render_in_view(settings, opened->blocks, *options, callbacks) : render(opened->blocks, *options, callbacks);
    progress_line("");
    if (!result) return result.status();
    const bool complete = result->report.complete;
    // An empty picture must not take the place of an older one.
    if (!complete && result->report.average_spp == 0 && settings.options.checkpoint.file.empty())
        return Status::interrupted("stopped by a signal before any sample was complete; no picture was written");
    const auto denoised = denoise_picture(settings, result->image, result->layers);
    expose(result->image, settings.exposure);
    const Status logged = monitor->finish(result->image, result->report);
    const ReportSeconds seconds{std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count(), opened->bake_seconds,
                                denoised ? *denoised : 0};
    RAYPAGER_TRY(write_results(settings, *options, scene, *result, seconds));  // the picture first, whatever became of the log
    RAYPAGER_TRY(logged);
    if (!denoised) return denoised.status().at(settings.output.string() + " is the picture with its noise");
    if (peers) RAYPAGER_TRY(wait_for(*peers));
    together = true;
    print_summary(settings, scene, result->report, seconds, monitor->final_rmse(), opened->ground_triangles);
    return complete ? Status() : stopped_early(settings, result->report);
}

}  // namespace

Status run_render(const Arguments& arguments) {
    auto settings = parse_render_settings(arguments);
    if (!settings) return settings.status();
    if (!*settings) return {};
    RAYPAGER_TRY(choose_denoiser(**settings));
    return run_in_ranks([&settings](std::shared_ptr<Peers> peers, bool& together) {
        RenderSettings own = **settings;
        own.options.peers = std::move(peers);
        return render_to_files(own, together);
    });
}

}  // namespace raypager
