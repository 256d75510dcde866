#include "cli/sweep_state.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <sstream>

#include "base/hash.hpp"
#include "base/words.hpp"
#include "cli/report.hpp"
#include "cli/tune_option.hpp"

namespace raypager {
namespace {

using Json = nlohmann::ordered_json;
using bench::SweepRun;
using bench::SweepVariant;

constexpr const char* end_mark = "finished";

// Everything that decides the figures of a run, but for its variant.
Json common_json(const bench::SweepSettings& settings, const BakedScene& scene) {
    const RenderOptions& o = settings.base;
    Json camera = Json::array();
    if (o.camera) {
        for (const Float3& v : {o.camera->eye, o.camera->right, o.camera->up, o.camera->forward})
            for (const float component : {v.x, v.y, v.z}) camera.push_back(component);
        camera.push_back(static_cast<uint32_t>(o.camera->projection));
        for (const float number : {o.camera->lens_radius, o.camera->focal_distance}) camera.push_back(number);
        for (const float share : o.camera->window) camera.push_back(share);
    }
    return {{"raypager", RAYPAGER_VERSION},
            {"scene", hex64(scene.identity())},
            {"--size", fmt::format("{}x{}", o.width, o.height)},
            {"--camera", camera},
            {"--spp", o.spp},
            {"--time", o.time_seconds},
            {"--max-depth", o.max_depth ? Json(*o.max_depth) : Json(nullptr)},
            {"--seed", o.seed},
            {"--device", o.device},
            {"--memory-limit", o.memory_limit},
            {"--host-limit", o.host_limit},
            {"--reference-spp", settings.reference.spp},
            {"--snapshots", settings.first_snapshot},
            {"--loads-in-flight", o.tuning.loads_in_flight},
            {"--hold", o.tuning.hold_above_ready ? Json(*o.tuning.hold_above_ready) : Json(nullptr)},
            {"--wait-for-loads", o.tuning.wait_for_loads},
            {"--tile", o.tuning.tile_size},
            {"--together", o.tuning.together},
            {"--region", o.tuning.region ? Json(*o.tuning.region) : Json(nullptr)},
            {"--tune", tuning_json(o.tuning.profile)}};
}

std::string variant_key(const SweepVariant& v) {
    return fmt::format("{} {} {} {} {}", v.limit.bytes, v.limit.percent, v.policy.name(), v.paths.name(), static_cast<int>(v.connection));
}

Json report_to_json(const RenderReport& r) {
    return {{"device", {r.device.name, r.device.platform, r.device.driver, r.device.type}},
            {"limits", {r.limits.memory_bytes, r.limits.geometry_bytes, r.limits.host_bytes}},
            {"peak", {r.peak.memory_bytes, r.peak.geometry_bytes, r.peak.host_bytes}},
            {"image", {r.width, r.height, r.spp, r.max_depth, r.paths, r.seed}},
            {"connection", r.connection},
            {"wide", r.form == BlockForm::wide},
            {"film", r.film_hash},
            {"seconds", {r.seconds.render, r.seconds.stall, r.seconds.trace, r.seconds.snapshots}},
            {"rays", {r.rays.camera, r.rays.bounce, r.rays.shadow}},
            {"paging", {r.paging.loads, r.paging.evictions, r.paging.bytes_loaded, r.paging.rounds, r.paging.requests_without_hit}}};
}

// Throws what the JSON library throws if it is not what report_to_json has written.
RenderReport report_from_json(const Json& json) {
    RenderReport r;
    const auto fill = [&json](const char* key, auto&... targets) {
        size_t at = 0;
        (json.at(key).at(at++).get_to(targets), ...);
    };
    fill("device", r.device.name, r.device.platform, r.device.driver, r.device.type);
    fill("limits", r.limits.memory_bytes, r.limits.geometry_bytes, r.limits.host_bytes);
    fill("peak", r.peak.memory_bytes, r.peak.geometry_bytes, r.peak.host_bytes);
    fill("image", r.width, r.height, r.spp, r.max_depth, r.paths, r.seed);
    json.at("connection").get_to(r.connection);
    r.form = json.at("wide").get<bool>() ? BlockForm::wide : BlockForm::stored;
    json.at("film").get_to(r.film_hash);
    fill("seconds", r.seconds.render, r.seconds.stall, r.seconds.trace, r.seconds.snapshots);
    fill("rays", r.rays.camera, r.rays.bounce, r.rays.shadow);
    fill("paging", r.paging.loads, r.paging.evictions, r.paging.bytes_loaded, r.paging.rounds, r.paging.requests_without_hit);
    return r;
}

Json run_to_json(const SweepRun& run, const SweepVariant& variant) {
    Json curve = Json::array(), journal = Json::array();
    for (const bench::ConvergencePoint& p : run.convergence) curve.push_back({p.seconds, p.spp, p.rmse, p.bytes_loaded});
    for (const PagingEvent& event : run.journal) journal.push_back({event.round, event.block, event.came ? 1 : 0});
    return {{"variant", variant_key(variant)},      {"repeat", run.repeat}, {"seconds", run.seconds}, {"wall_seconds", run.wall_seconds},
            {"report", report_to_json(run.report)}, {"convergence", curve}, {"journal", journal},     {"round_seconds", run.round_seconds}};
}

SweepRun run_from_json(const Json& json) {
    SweepRun run;
    json.at("repeat").get_to(run.repeat);
    json.at("seconds").get_to(run.seconds);
    json.at("wall_seconds").get_to(run.wall_seconds);
    run.report = report_from_json(json.at("report"));
    for (const Json& p : json.at("convergence"))
        run.convergence.push_back({p.at(0).get<double>(), p.at(1).get<double>(), p.at(2).get<double>(), p.at(3).get<uint64_t>()});
    for (const Json& e : json.at("journal")) run.journal.push_back({e.at(0).get<uint32_t>(), e.at(1).get<uint32_t>(), e.at(2).get<int>() != 0});
    json.at("round_seconds").get_to(run.round_seconds);
    return run;
}

std::string line_of(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n"; }

// What a state file holds, as far as it is whole: a process that is killed may leave half a line.
struct Content {
    Json common;
    std::vector<Json> runs;
    bool finished = false;
};

Result<Content> read_content(const std::filesystem::path& path) {
    const auto text = read_text(path, uint64_t{1} << 34);
    if (!text) return text.status();
    Content content;
    std::istringstream lines(*text);
    for (std::string line; std::getline(lines, line);) {
        Json json = Json::parse(line, nullptr, false);
        if (json.is_discarded() || !json.is_object()) break;
        if (json.contains(end_mark))
            content.finished = true;
        else if (content.common.is_null())
            content.common = std::move(json);
        else
            content.runs.push_back(std::move(json));
    }
    return content;
}

// A usage error for the first thing in which a sweep that goes on differs from what it was.
Status check_common(const std::filesystem::path& path, const Json& before, const Json& now) {
    for (const auto& [key, value] : now.items())
        if (!before.contains(key) || before[key] != value)
            return Status::usage(fmt::format("bench sweep: --resume: the runs in {} were made with {} {}, not {}; give the same, or remove that file",
                                             path.string(), key, before.contains(key) ? before[key].dump() : "missing", value.dump()));
    return {};
}

}  // namespace

Result<SweepState> SweepState::open(const std::filesystem::path& folder, const bench::SweepSettings& settings, const BakedScene& scene, bool resume) {
    SweepState state;
    state.path_ = folder / "sweep.runs";
    // As a file would give it back, so that the two can be compared.
    const Json common = Json::parse(common_json(settings, scene).dump(-1, ' ', false, Json::error_handler_t::replace));
    std::string kept = line_of(common);
    std::error_code ignored;
    if (std::filesystem::exists(state.path_, ignored)) {
        const auto content = read_content(state.path_);
        if (!content) return content.status();
        if (!resume && !content->finished && !content->runs.empty())
            return Status::failed(fmt::format("{}: holds {} of a sweep that was stopped; go on with --resume, or remove it to start over",
                                              state.path_.string(), counted(content->runs.size(), "run")));
        if (resume && !content->common.is_null()) RAYPAGER_TRY(check_common(state.path_, content->common, common));
        const auto variants = bench::sweep_variants(settings);
        for (const Json& json : resume ? content->runs : std::vector<Json>()) {
            try {
                SweepRun run = run_from_json(json);
                const std::string key = json.at("variant").get<std::string>();
                const auto found = std::find_if(variants.begin(), variants.end(), [&](const SweepVariant& v) { return variant_key(v) == key; });
                state.device_ = run.report.device.name;
                kept += line_of(json);
                if (found == variants.end() || run.repeat >= settings.repeats) continue;
                run.variant = static_cast<size_t>(found - variants.begin());
                state.earlier_.push_back(std::move(run));
            } catch (const Json::exception&) {
                return Status::failed(fmt::format("{}: a run in it makes no sense; remove the file to start over", state.path_.string()));
            }
        }
    }
    RAYPAGER_TRY(write_text(state.path_, kept));
    auto file = GrowingFile::reopen(state.path_);
    if (!file) return file.status();
    state.file_ = std::move(*file);
    return state;
}

Status SweepState::add(const SweepRun& run, const SweepVariant& variant) {
    const std::string& name = run.report.device.name;
    if (!device_.empty() && device_ != name)
        return Status::failed(
            fmt::format("{}: the runs in it were made on {}, not on {}; choose that with --device, or remove the file to start over", path_.string(),
                        device_, name));
    device_ = name;
    return file_.append(line_of(run_to_json(run, variant)));
}

Status SweepState::finish() { return file_.append(line_of({{end_mark, true}})); }

}  // namespace raypager
