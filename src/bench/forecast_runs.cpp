#include "bench/forecast_runs.hpp"

#include <cmath>

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

}  // namespace

Result<LimitPlan> plan_within(const BlockSource& source, const RenderOptions& options) {
    const BakedScene& scene = source.scene();
    const auto params = make_params(scene, options);
    if (!params) return params.status();
    DeviceHooks none;
    const auto choice = choose_devices(options.device, options.allow_different, none);
    if (!choice) return choice.status();
    if (choice->selectors.size() > 1) return Status::usage("a plan is for one device; name it with --device");
    const auto device = Device::open(choice->selectors.front(), options.memory_limit, options.tuning.profile);
    if (!device) return device.status();
    const DeviceInfo& info = (*device)->info();
    RAYPAGER_TRY(check_picture_size(*params, info));
    const auto plan = plan_render(scene, options, {}, *params, info, (*device)->budget().limit());
    if (!plan) return plan.status();
    return LimitPlan{info.name, plan->residency.pool_bytes, plan->device_bytes, scene.memory_bytes(plan->form), plan->params.slot_count};
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
    return pilot;
}

}  // namespace raypager::bench
