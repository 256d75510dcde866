#include "cli/report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>

#include "base/hash.hpp"
#include "cli/tune_option.hpp"
#include "cli/values.hpp"
#include "cli/view.hpp"

namespace raypager {
namespace {

using Json = nlohmann::ordered_json;

Json limits_json(const RenderReport::Limits& limits) {
    return {{"memory_bytes", limits.memory_bytes}, {"geometry_bytes", limits.geometry_bytes}, {"host_bytes", limits.host_bytes}};
}

Json vector_json(const Float3& v) { return {v.x, v.y, v.z}; }

// What a pinhole camera does not have is left out.
Json axes_json(const Camera& camera) {
    Json json = {{"eye", vector_json(camera.eye)},
                 {"right", vector_json(camera.right)},
                 {"up", vector_json(camera.up)},
                 {"forward", vector_json(camera.forward)}};
    constexpr const char* projections[] = {"perspective", "orthographic", "equirectangular", "equal-area"};
    if (camera.projection != Projection::perspective) json["projection"] = projections[static_cast<size_t>(camera.projection)];
    if (camera.lens_radius > 0) json["lens"] = {{"radius", camera.lens_radius}, {"focal_distance", camera.focal_distance}};
    if (camera.sees_all_around()) json["window"] = camera.window;
    return json;
}

Json text_json(const std::optional<std::string>& text) { return text ? Json(*text) : Json(nullptr); }

Json path_json(const std::optional<std::filesystem::path>& path) { return path ? Json(path->string()) : Json(nullptr); }

Json point_radius_json(const PointOptions& options) {
    if (options.radius > 0) return options.radius;
    return options.radius_from_spacing ? Json("auto") : Json(nullptr);
}

Json settings_json(const RenderSettings& settings, const RenderOptions& effective, const Blocks& scene, const RenderReport& report) {
    const CheckpointOptions& checkpoint = effective.checkpoint;
    Json inputs = Json::array();
    for (const auto& input : settings.inputs) inputs.push_back(input.string());
    return {{"input", inputs},
            {"output", settings.output.string()},
            {"cache_dir", path_json(settings.cache_directory)},
            {"device", report.device.name},
            {"memory_limit", report.limits.memory_bytes},
            {"geometry_limit", report.limits.geometry_bytes},
            {"host_limit", report.limits.host_bytes},
            {"spp", effective.spp},
            {"time", effective.time_seconds > 0 ? Json(effective.time_seconds) : Json(nullptr)},
            {"size", {report.width, report.height}},
            {"max_depth", report.max_depth},
            {"seed", report.seed},
            {"paths", report.paths},
            {"policy", report.policy},
            {"connection", report.connection},
            {"traversal", report.form == BlockForm::wide ? "stream" : "ray"},
            {"preset", settings.paper_preset ? Json("paper") : Json(nullptr)},
            {"pool", effective.tuning.pool_place == PoolPlace::host ? "host" : "device"},
            {"loads_in_flight", effective.tuning.loads_in_flight > 0 ? Json(effective.tuning.loads_in_flight) : Json(nullptr)},
            {"hold", effective.tuning.hold_above_ready ? Json(*effective.tuning.hold_above_ready) : Json(nullptr)},
            {"wait_for_loads", effective.tuning.wait_for_loads},
            {"tile", report.tile_size},
            {"together", report.together},
            {"region", report.region},
            {"tune", tuning_json(effective.tuning.profile)},
            {"camera", axes_json(effective.camera.value_or(scene.camera()))},
            {"material", text_json(settings.texts.material)},
            {"sky", text_json(settings.texts.sky)},
            {"light", text_json(settings.texts.light)},
            {"no_ground", settings.look.no_ground},
            {"background", text_json(settings.texts.background)},
            {"exposure", settings.exposure},
            {"adaptive", effective.adaptive_error > 0 ? Json(effective.adaptive_error) : Json(nullptr)},
            {"denoise", settings.denoise ? Json(settings.denoiser) : Json(nullptr)},
            {"layers", settings.options.layers.any() ? Json(film_layer_list(settings.options.layers)) : Json(nullptr)},
            {"turntable", settings.turntable > 0 ? Json(settings.turntable) : Json(nullptr)},
            {"point_radius", point_radius_json(settings.bake.points)},
            {"point_scale", settings.bake.points.radius_scale},
            {"cull_to_camera", settings.bake.points.cull_to_camera},
            {"cull_margin", settings.bake.points.cull_margin},
            {"filter_to_image", settings.bake.points.filter_to_image},
            {"reference", path_json(settings.reference)},
            {"log", path_json(settings.log)},
            {"snapshots", settings.snapshot_seconds > 0 ? Json(settings.snapshot_seconds) : Json(nullptr)},
            {"report", path_json(settings.report)},
            {"checkpoint", checkpoint.file.empty() ? Json(nullptr) : Json(checkpoint.file.string())},
            {"checkpoint_every", checkpoint.file.empty() ? Json(nullptr) : Json(checkpoint.every_seconds)},
            {"resume", checkpoint.resume},
            {"record_trace", effective.record.file.empty() ? Json(nullptr) : Json(effective.record.file.string())},
            {"trace_paths", !effective.record.file.empty() ? Json(effective.record.paths) : Json(nullptr)},
            {"progress", settings.progress}};
}

double ratio(double a, double b) { return b > 0 ? a / b : 0; }

std::string paging_table(const Blocks& scene, const RenderReport& report, uint64_t ground) {
    const uint64_t all = scene.memory_bytes(report.form);
    const uint64_t resident = std::min(report.limits.geometry_bytes, all);
    const auto& paging = report.paging;
    std::string text;
    const auto line = [&text](const char* name, const std::string& value) { text += fmt::format("  {:<16} {}\n", name, value); };
    line("device", fmt::format("{}, {:.2f} Mrays/s", report.device.name, ratio(double(report.rays.total()), report.seconds.render) / 1e6));
    line("scene", fmt::format("{} in {}, {}", primitives_text(scene.triangles(), scene.spheres(), ground), counted(scene.count(), "block"),
                              format_bytes(scene.bytes(report.form))));
    if (scene.images() > 0)
        line("images",
             fmt::format("{} in {}, {}", format_count(scene.images()), counted(scene.pages(), "page"), format_bytes(scene.texture_bytes())));
    line("resident limit", fmt::format("{}, {:.1f} % of the scene", format_bytes(report.limits.geometry_bytes),
                                       all ? 100 * ratio(double(resident), double(all)) : 100.0));
    line("loads", fmt::format("{}, {} evicted",
                              counted(paging.loads, scene.pages() > 0 ? "block or page" : "block", scene.pages() > 0 ? "blocks and pages" : ""),
                              format_count(paging.evictions)));
    line("loaded", fmt::format("{}, {:.1f} times the scene, {:.1f} bytes per ray", format_bytes(paging.bytes_loaded),
                               ratio(double(paging.bytes_loaded), double(all)), ratio(double(paging.bytes_loaded), double(report.rays.total()))));
    line("stalled", fmt::format("{} with nothing to trace, {:.1f} % of the render", format_duration(report.seconds.stall),
                                100 * ratio(report.seconds.stall, report.seconds.render)));
    line("device memory", fmt::format("{} at most, limit {}", format_bytes(report.peak.memory_bytes), format_bytes(report.limits.memory_bytes)));
    return text;
}

}  // namespace

Json scene_json(const Blocks& scene, BlockForm form) {
    const double primitives = double(scene.triangles() + scene.spheres());
    return {{"triangles", scene.triangles()},
            {"spheres", scene.spheres()},
            {"blocks", scene.count()},
            {"block_bytes_max", scene.largest(form)},
            {"geometry_bytes", scene.bytes(form)},
            {"stored_bytes", scene.bytes(BlockForm::stored)},
            {"bytes_per_primitive", ratio(double(scene.bytes(form)), primitives)},
            {"images", scene.images()},
            {"pages", scene.pages()},
            {"texture_bytes", scene.texture_bytes()}};
}

Json bounds_json(const Blocks& scene) { return {{"min", scene.lower()}, {"max", scene.upper()}}; }

std::array<double, 3> center_of(const Blocks& scene) {
    std::array<double, 3> center = {};
    const auto lower = scene.lower(), upper = scene.upper();
    for (size_t a = 0; a < 3; a++) center[a] = 0.5 * (double(lower[a]) + upper[a]);
    return center;
}

Json camera_json(const Camera& camera, uint32_t width, uint32_t height, const Blocks& scene) {
    const std::string text = camera_string(camera, width, height, center_of(scene));
    return text.empty() ? Json(nullptr) : Json(text);
}

// A camera that was given is told as it was given.
Json effective_camera_json(const RenderSettings& settings, const RenderOptions& effective, const Blocks& scene, const RenderReport& report) {
    if (settings.camera && settings.turntable == 0) return format_camera(*settings.camera);
    return camera_json(effective.camera.value_or(scene.camera()), report.width, report.height, scene);
}

// Streams extend and connect in one.
Json stages_json(const std::array<double, 5>& seconds, BlockForm form) {
    if (form == BlockForm::wide)
        return {{"wake", seconds[0]}, {"generate", seconds[1]}, {"extend_and_connect", seconds[2] + seconds[4]}, {"shade", seconds[3]}};
    return {{"wake", seconds[0]}, {"generate", seconds[1]}, {"extend", seconds[2]}, {"shade", seconds[3]}, {"connect", seconds[4]}};
}

Json layers_json(const RenderReport& report) {
    if (!report.layers.any()) return nullptr;
    Json names = Json::array();
    for (uint32_t i = 0; i < film_layer_count; i++)
        if (report.layers.has(static_cast<FilmLayer>(i))) names.push_back(film_layer_name(static_cast<FilmLayer>(i)));
    return {{"names", names}, {"hash", hex64(report.layers_hash)}};
}

Json report_json(const RenderSettings& settings, const RenderOptions& effective, const Blocks& scene, const RenderReport& report,
                 const ReportSeconds& seconds) {
    const auto& rays = report.rays;
    const auto& paging = report.paging;
    return {{"raypager", RAYPAGER_VERSION},
            {"device",
             {{"name", report.device.name}, {"platform", report.device.platform}, {"driver", report.device.driver}, {"type", report.device.type}}},
            {"scene", scene_json(scene, report.form)},
            {"limits", limits_json(report.limits)},
            {"peak", limits_json(report.peak)},
            {"image",
             {{"width", report.width},
              {"height", report.height},
              {"spp", report.spp},
              {"average_spp", report.average_spp},
              {"complete", report.complete},
              {"film_hash", hex64(report.film_hash)}}},
            {"layers", layers_json(report)},
            {"camera", effective_camera_json(settings, effective, scene, report)},
            {"bounds", bounds_json(scene)},
            {"seconds",
             {{"total", seconds.total},
              {"bake", seconds.bake},
              {"denoise", seconds.denoise},
              {"render", report.seconds.render},
              {"trace", report.seconds.trace},
              {"stall", report.seconds.stall},
              {"kernel_build", report.seconds.build},
              {"checkpoints", report.checkpoint.seconds},
              {"stages", stages_json(report.seconds.stages, report.form)}}},
            {"rays",
             {{"camera", rays.camera},
              {"bounce", rays.bounce},
              {"shadow", rays.shadow},
              {"total", rays.total()},
              {"per_second", ratio(double(rays.total()), report.seconds.render)}}},
            {"paging",
             {{"policy", report.policy},
              {"loads", paging.loads},
              {"evictions", paging.evictions},
              {"bytes_loaded", paging.bytes_loaded},
              {"rounds", paging.rounds},
              {"wants_without_hit", paging.requests_without_hit},
              {"texture_waits", paging.texture_waits}}},
            {"checkpoint", {{"runs", report.checkpoint.runs}, {"written", report.checkpoint.written}}},
            {"settings", settings_json(settings, effective, scene, report)}};
}

std::string json_text(const Json& json) { return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n"; }

std::string primitives_text(uint64_t triangles, uint64_t spheres, uint64_t ground) {
    std::string text;
    if (triangles > 0 || spheres == 0) text = counted(triangles, "triangle");
    if (ground > 0) text += fmt::format(" ({} of them ground)", format_count(ground));
    if (spheres > 0) text += (text.empty() ? "" : " and ") + counted(spheres, "sphere or point", "spheres and points");
    return text;
}

std::string instances_text(uint64_t instances, uint64_t objects) {
    return objects > 0 ? fmt::format(" and {} of {}", counted(instances, "instance"), counted(objects, "object")) : "";
}

std::string summary_text(const Blocks& scene, const RenderReport& report, const ReportSeconds& seconds, uint64_t ground) {
    const std::string spp = report.complete ? std::to_string(report.spp) : fmt::format("{:.1f}", report.average_spp);
    std::string text = fmt::format("raypager: {}x{}, {} spp in {} (baking {}, rendering {})\n", report.width, report.height, spp,
                                   format_duration(seconds.total), format_duration(seconds.bake), format_duration(report.seconds.render));
    text += paging_table(scene, report, ground);
    if (seconds.denoise > 0) text += fmt::format("  {:<16} {}\n", "denoised", format_duration(seconds.denoise));
    if (report.clamped_samples > 0)
        text += fmt::format("raypager: warning: too bright or not finite, and so clamped: {}\n", counted(report.clamped_samples, "sample"));
    return text;
}

}  // namespace raypager
