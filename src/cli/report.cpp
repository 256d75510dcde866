#include "cli/report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>

#include "cli/values.hpp"
#include "cli/view.hpp"
#include "raypager/report.hpp"

namespace raypager {
namespace {

using Json = nlohmann::ordered_json;

Json text_json(const std::optional<std::string>& text) { return text ? Json(*text) : Json(nullptr); }

Json path_json(const std::optional<std::filesystem::path>& path) { return path ? Json(path->string()) : Json(nullptr); }

Json point_radius_json(const PointOptions& options) {
    if (options.radius > 0) return options.radius;
    return options.radius_from_spacing ? Json("auto") : Json(nullptr);
}

// A report's objects, with more behind what they have.
Json with(Json json, const Json& more) {
    json.update(more);
    return json;
}

// The engine's settings, and what the command line alone knows.
Json settings_json(const RenderSettings& settings, const Json& of_render) {
    Json inputs = Json::array();
    for (const auto& input : settings.inputs) inputs.push_back(input.string());
    const Json files = {{"input", inputs}, {"output", settings.output.string()}, {"cache_dir", path_json(settings.cache_directory)}};
    return with(with(files, of_render), {{"preset", settings.paper_preset ? Json("paper") : Json(nullptr)},
                                         {"material", text_json(settings.texts.material)},
                                         {"sky", text_json(settings.texts.sky)},
                                         {"light", text_json(settings.texts.light)},
                                         {"no_ground", settings.look.no_ground},
                                         {"background", text_json(settings.texts.background)},
                                         {"exposure", settings.exposure},
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
                                         {"progress", settings.progress}});
}

double ratio(double a, double b) { return b > 0 ? a / b : 0; }

// Where blocks came from that were not in a rank's cache.
std::string ranks_text(const RenderReport& report) {
    RenderReport::Rank all;
    for (const RenderReport::Rank& rank : report.ranks) {
        all.from_memory += rank.from_memory;
        all.from_peers += rank.from_peers;
        all.from_file += rank.from_file;
        all.late += rank.late;
        all.damaged += rank.damaged;
    }
    std::string text = fmt::format("memory {}, other ranks {}, the file {}", format_bytes(all.from_memory), format_bytes(all.from_peers),
                                   format_bytes(all.from_file));
    if (all.late > 0) text += fmt::format(", {} late", counted(all.late, "answer"));
    if (all.damaged > 0) text += fmt::format(", {} damaged", counted(all.damaged, "block"));
    return text;
}

std::string paging_table(const Blocks& scene, const RenderReport& report, uint64_t ground) {
    const uint64_t all = scene.memory_bytes(report.form);
    const uint64_t resident = std::min(report.limits.geometry_bytes, all);
    const auto& paging = report.paging;
    std::string text;
    const auto line = [&text](const char* name, const std::string& value) { text += fmt::format("  {:<16} {}\n", name, value); };
    const size_t devices = report.devices.size();
    line(devices > 1 ? "devices" : "device", fmt::format("{}{}, {:.2f} Mrays/s", devices > 1 ? std::to_string(devices) + " x " : "",
                                                         report.device.name, ratio(double(report.rays.total()), report.seconds.render) / 1e6));
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
    const double stall = report.seconds.stall / static_cast<double>(std::max<size_t>(1, devices));
    line("stalled", fmt::format("{} idle while rays wait for blocks, {:.1f} % of the render", format_duration(stall),
                                100 * ratio(stall, report.seconds.render)));
    uint64_t samples = 0;
    for (const RenderReport::DeviceWork& device : report.devices) samples += device.samples;
    for (const RenderReport::DeviceWork& device : report.devices) {
        if (report.devices.size() == 1) break;
        line((report.ranks.size() > 1 ? fmt::format("rank {} device {}", device.rank, device.index) : fmt::format("device {}", device.index)).c_str(),
             fmt::format("{:.0f} % of the samples, {}, {} loaded, {} of memory", 100 * ratio(double(device.samples), double(samples)),
                         counted(device.loads, "load"), format_bytes(device.bytes_loaded), format_bytes(device.peak_memory_bytes)));
    }
    if (report.ranks.size() > 1) line("blocks from", ranks_text(report));
    line("device memory", fmt::format("{} at most, limit {}", format_bytes(report.peak.memory_bytes), format_bytes(report.limits.memory_bytes)));
    return text;
}

}  // namespace

Json scene_json(const Blocks& scene, BlockForm form) { return Json::parse(scene_text(scene, form)); }
Json bounds_json(const Blocks& scene) { return Json::parse(bounds_text(scene)); }

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

Json report_json(const RenderSettings& settings, const RenderOptions& effective, const Blocks& scene, const RenderReport& report,
                 const ReportSeconds& seconds) {
    Json json = Json::parse(report_text(scene, effective, report, seconds));
    if (settings.camera && settings.turntable == 0) json["camera"] = format_camera(*settings.camera);  // as it was given
    json["settings"] = settings_json(settings, json["settings"]);
    return json;
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
