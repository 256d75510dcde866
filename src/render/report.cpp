#include "raypager/report.hpp"

#include <array>
#include <nlohmann/json.hpp>

#include "base/hash.hpp"
#include "raypager/camera_text.hpp"

namespace raypager {
namespace {

using Json = nlohmann::ordered_json;

double ratio(double a, double b) { return b > 0 ? a / b : 0; }

// Names of files and devices that are no UTF-8 do not throw.
std::string text_of(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

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

Json scene_object(const Blocks& scene, BlockForm form) {
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

Json bounds_object(const Blocks& scene) { return {{"min", scene.lower()}, {"max", scene.upper()}}; }

// What --camera takes to look like this at the middle of the scene.
Json camera_object(const RenderOptions& options, const RenderReport& report, const Blocks& scene) {
    std::array<double, 3> center = {};
    for (size_t a = 0; a < 3; a++) center[a] = 0.5 * (double(scene.lower()[a]) + scene.upper()[a]);
    const std::string text = camera_string(options.camera.value_or(scene.camera()), report.width, report.height, center);
    return text.empty() ? Json(nullptr) : Json(text);
}

// Streams extend and connect in one.
Json stages_json(const std::array<double, 5>& seconds, BlockForm form) {
    if (form == BlockForm::wide)
        return {{"wake", seconds[0]}, {"generate", seconds[1]}, {"extend_and_connect", seconds[2] + seconds[4]}, {"shade", seconds[3]}};
    return {{"wake", seconds[0]}, {"generate", seconds[1]}, {"extend", seconds[2]}, {"shade", seconds[3]}, {"connect", seconds[4]}};
}

Json layers_object(const RenderReport& report) {
    if (!report.layers.any()) return nullptr;
    Json names = Json::array();
    for (uint32_t i = 0; i < film_layer_count; i++)
        if (report.layers.has(static_cast<FilmLayer>(i))) names.push_back(film_layer_name(static_cast<FilmLayer>(i)));
    return {{"names", names}, {"hash", hex64(report.layers_hash)}};
}

Json tuning_object(const ProfileChanges& tuning) {
    Json json;
    for (const ProfileChange& change : tuning) {
        const bool whole = change.field->unit != ProfileField::Unit::number;
        json[std::string(change.field->name)] = whole ? Json(static_cast<uint64_t>(change.value)) : Json(change.value);
    }
    return json;
}

Json devices_array(const RenderReport& report) {
    Json devices = Json::array();
    for (const RenderReport::DeviceWork& device : report.devices)
        devices.push_back({{"name", device.facts.name},
                           {"rank", device.rank},
                           {"index", device.index},
                           {"paths", device.samples},
                           {"rays", device.rays},
                           {"loads", device.loads},
                           {"evictions", device.evictions},
                           {"bytes_loaded", device.bytes_loaded},
                           {"rounds", device.rounds},
                           {"peak_bytes", device.peak_memory_bytes},
                           {"trace_seconds", device.trace_seconds},
                           {"stall_seconds", device.stall_seconds}});
    return devices;
}

Json ranks_array(const RenderReport& report) {
    Json ranks = Json::array();
    for (const RenderReport::Rank& rank : report.ranks)
        ranks.push_back({{"kept_bytes", rank.kept_bytes},
                         {"bytes_from_memory", rank.from_memory},
                         {"bytes_from_ranks", rank.from_peers},
                         {"bytes_from_file", rank.from_file},
                         {"late", rank.late},
                         {"damaged", rank.damaged},
                         {"peak_host_bytes", rank.peak_host_bytes}});
    return ranks;
}

Json settings_object(const RenderOptions& options, const Blocks& scene, const RenderReport& report) {
    const CheckpointOptions& checkpoint = options.checkpoint;
    return {{"device", report.device.name},
            {"memory_limit", report.limits.memory_bytes},
            {"geometry_limit", report.limits.geometry_bytes},
            {"host_limit", report.limits.host_bytes},
            {"allow_different", options.allow_different},
            {"spp", options.spp},
            {"time", options.time_seconds > 0 ? Json(options.time_seconds) : Json(nullptr)},
            {"adaptive", options.adaptive_error > 0 ? Json(options.adaptive_error) : Json(nullptr)},
            {"layers", report.layers.any() ? Json(film_layer_list(report.layers)) : Json(nullptr)},
            {"size", {report.width, report.height}},
            {"max_depth", report.max_depth},
            {"seed", report.seed},
            {"paths", report.paths},
            {"policy", report.policy},
            {"connection", report.connection},
            {"traversal", report.form == BlockForm::wide ? "stream" : "ray"},
            {"pool", options.tuning.pool_place == PoolPlace::host ? "host" : "device"},
            {"loads_in_flight", options.tuning.loads_in_flight > 0 ? Json(options.tuning.loads_in_flight) : Json(nullptr)},
            {"hold", options.tuning.hold_above_ready ? Json(*options.tuning.hold_above_ready) : Json(nullptr)},
            {"wait_for_loads", options.tuning.wait_for_loads},
            {"tile", report.tile_size},
            {"together", report.together},
            {"region", report.region},
            {"film_rows", report.film_rows},
            {"tune", tuning_object(options.tuning.profile)},
            {"camera", axes_json(options.camera.value_or(scene.camera()))},
            {"checkpoint", checkpoint.file.empty() ? Json(nullptr) : Json(checkpoint.file.string())},
            {"checkpoint_every", checkpoint.file.empty() ? Json(nullptr) : Json(checkpoint.every_seconds)},
            {"resume", checkpoint.resume},
            {"record_trace", options.record.file.empty() ? Json(nullptr) : Json(options.record.file.string())},
            {"trace_paths", !options.record.file.empty() ? Json(options.record.paths) : Json(nullptr)}};
}

}  // namespace

std::string scene_text(const Blocks& scene, BlockForm form) { return text_of(scene_object(scene, form)); }
std::string bounds_text(const Blocks& scene) { return text_of(bounds_object(scene)); }

std::string tuning_text(const ProfileChanges& tuning) { return text_of(tuning_object(tuning)); }

std::string report_text(const Blocks& scene, const RenderOptions& options, const RenderReport& report, const ReportSeconds& seconds) {
    const auto& rays = report.rays;
    const auto& paging = report.paging;
    return text_of(
        {{"raypager", RAYPAGER_VERSION},
         {"device",
          {{"name", report.device.name}, {"platform", report.device.platform}, {"driver", report.device.driver}, {"type", report.device.type}}},
         {"devices", devices_array(report)},
         {"ranks", ranks_array(report)},
         {"scene", scene_object(scene, report.form)},
         {"limits", limits_json(report.limits)},
         {"peak", limits_json(report.peak)},
         {"image",
          {{"width", report.width},
           {"height", report.height},
           {"spp", report.spp},
           {"average_spp", report.average_spp},
           {"complete", report.complete},
           {"film_hash", hex64(report.film_hash)}}},
         {"layers", layers_object(report)},
         {"camera", camera_object(options, report, scene)},
         {"bounds", bounds_object(scene)},
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
         {"settings", settings_object(options, scene, report)}});
}

}  // namespace raypager
