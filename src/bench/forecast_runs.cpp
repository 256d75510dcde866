#include "bench/forecast_runs.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>

#include "device/device.hpp"
#include "device/select.hpp"
#include "render/params.hpp"
#include "render/plan.hpp"

namespace raypager::bench {
namespace {

// Says of each mark how much had left by then, and returns how much is there in the end. All that came is either of them. What leaves tells better
// than what comes how much is moved while a render goes on: parts meet blocks for the first time that the whole render would have met long before.
double add_evictions(const BakedScene& scene, const MeasuredRender& render, std::vector<PilotMark>& marks) {
    double there = 0, gone = 0;
    size_t rounds = 0, event = 0;
    for (PilotMark& mark : marks) {
        while (rounds < render.round_seconds.size() && static_cast<double>(render.round_seconds[rounds]) <= mark.extent.seconds) rounds++;
        for (; event < render.journal.size() && (render.journal[event].round <= rounds || &mark == &marks.back()); event++) {
            const double bytes = scene.pageable_bytes(render.journal[event].block, render.report.form);
            there += render.journal[event].came ? bytes : -bytes;
            gone += render.journal[event].came ? 0 : bytes;
        }
        mark.extent.bytes = gone;
    }
    return there;
}

double bytes_seen(const BakedScene& scene, const MeasuredRender& render) {
    std::vector<bool> seen(scene.pageable_count());
    double bytes = 0;
    for (const PagingEvent& event : render.journal) {
        if (seen[event.block]) continue;
        seen[event.block] = true;
        bytes += scene.pageable_bytes(event.block, render.report.form);
    }
    return bytes;
}

Result<std::unique_ptr<Device>> open_one(const RenderOptions& options) {
    DeviceHooks none;
    const auto choice = choose_devices(options.device, options.allow_different, none);
    if (!choice) return choice.status();
    if (choice->selectors.size() > 1) return Status::usage("a plan is for one device; name it with --device");
    return Device::open(choice->selectors.front(), options.memory_limit, options.tuning.profile);
}

}  // namespace

Result<LimitPlan> plan_within(const BlockSource& source, const RenderOptions& options, uint32_t nodes) {
    const BakedScene& scene = source.scene();
    const auto params = make_params(scene, options);
    if (!params) return params.status();
    const auto device = open_one(options);
    if (!device) return device.status();
    const DeviceInfo& info = (*device)->info();
    const Sharers sharers = {.all_devices = nodes};
    RAYPAGER_TRY(check_picture_size(*params, info, may_take_windows(options, {}, *params, sharers)));
    const auto plan = plan_render(scene, options, {}, *params, info, (*device)->budget().limit(), sharers);
    if (!plan) return plan.status();
    LimitPlan within;
    within.device = info.name;
    within.pool_bytes = plan->residency.pool_bytes, within.device_bytes = plan->device_bytes, within.host_bytes = plan->host_limit;
    within.scene_bytes = scene.memory_bytes(plan->form);
    within.slots = plan->params.slot_count, within.region_pixels = plan->params.order.region;
    within.film_in_parts = plan->params.film_rows < plan->params.height;
    within.policy = plan->residency.policy, within.rounds_under_way = plan->rounds_under_way;
    return within;
}

Result<double> upload_rate(const RenderOptions& options) {
    auto device = open_one(options);
    if (!device) return device.status();
    const uint64_t bytes = std::clamp<uint64_t>((*device)->budget().limit() / 4, 4096, uint64_t{32} << 20);
    const auto pinned = (*device)->allocate_pinned(bytes);
    if (!pinned) return pinned.status();
    const auto buffer = (*device)->allocate(bytes, "measuring uploads");
    if (!buffer) return buffer.status();
    std::memset(pinned->bytes().data(), 1, bytes);
    double best = 1e30;
    for (int i = 0; i < 5; i++) {
        const auto begin = std::chrono::steady_clock::now();
        RAYPAGER_TRY((*device)->uploads().write_now(*buffer, 0, pinned->bytes()));
        best = std::min(best, std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
    }
    return static_cast<double>(bytes) / std::max(best, 1e-9);
}

Result<Pilot> run_pilot(const BlockSource& source, const RenderOptions& options, const RenderCallbacks& callbacks) {
    Pilot pilot;
    double pixels = 1;
    RenderInstruments instruments;
    instruments.keep_journal = true;
    instruments.parts = [&](const rp_render_params& params) {
        const uint64_t count = uint64_t{params.width} * params.height;
        pixels = static_cast<double>(count);
        pilot.samples = count * params.spp;
        pilot.parts = pilot_parts(pilot.samples, count, params.slot_count);
        std::vector<SampleRange> ranges;
        for (const PilotPart& part : pilot.parts) ranges.push_back({part.begin, part.end});
        // Progress counts what has begun, not the numbers between.
        uint64_t begun = 0;
        for (PilotPart& part : pilot.parts) {
            part = {begun, begun + (part.from - part.begin), begun + (part.end - part.begin)};
            begun = part.end;
        }
        return ranges;
    };
    RenderCallbacks own;
    own.warning = callbacks.warning;
    own.progress = [&](const RenderProgress& p) {
        const auto rounds = static_cast<double>(pilot.marks.size() + 1);
        pilot.marks.push_back({static_cast<uint64_t>(std::llround(p.spp * pixels)), {p.seconds, static_cast<double>(p.rays), rounds, 0}});
    };
    RenderOptions each_round = options;
    each_round.progress_seconds = 0;
    const auto result = render(source, each_round, own, instruments);
    if (!result) return result.status();
    if (!result->report.complete) return Status::interrupted("stopped before the forecast was complete");
    pilot.resident_bytes = add_evictions(source.scene(), *result, pilot.marks);
    pilot.seen_bytes = bytes_seen(source.scene(), *result);
    return pilot;
}

}  // namespace raypager::bench
