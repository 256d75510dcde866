// A way of tracing rays on a device: which kernels make up a round, and in which order they run. There are two, for two forms of blocks: rays one by
// one (SingleRayBackend), and streams of rays (StreamBackend). What both share is owned by Wavefront.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "device/device.hpp"
#include "raypager/abi/block.h"
#include "raypager/abi/scene.h"
#include "raypager/status.hpp"
#include "wavefront/geometry_buffers.hpp"
#include "wavefront/path_state.hpp"
#include "wavefront/round_counters.hpp"
#include "wavefront/round_reports.hpp"

namespace raypager {

// What a render has on the device whatever the way of tracing, geometry aside.
struct WavefrontBuffers {
    Buffer params, materials, lights, light_steps, ranges;
    Buffer textures;  // empty in scenes without
    PathSlots slots;
    Buffer film, queue, free_list, again, counters;
    Buffer stage_pixels;  // where sampling is adaptive
    RoundReports reports;
};

// What kernels are built with, as " -D...": for those that trace, those that shade, and those that make camera rays; and for all of single rays.
struct BackendSettings {
    std::string tracing, shading, cameras, single_rays;
    bool notes = true;      // kernels note which blocks are entered, and pages looked up
    bool textures = false;  // the scene has some: stages must be built for it
};

// A round that is to be started.
struct Round {
    uint32_t number = 0;
    std::span<const rp_page> page_changes;      // entries of the page table that are not on the device yet
    std::span<const uint32_t> newly_published;  // blocks that are in the page table with them, and were not in the round before
    rp_sample_numbers numbers = {0, 0, 0, 0};   // of the samples that come next
    uint32_t listed_again = 0;                  // samples in WavefrontBuffers::again
    bool more_later = false;                    // rounds to come will have more samples
    uint32_t report = 0;                        // number of the report that it fills
};

// Profiling events of the stages of one round. begin: of streams only. connect: empty where extension rays and shadow rays are traced by one kernel.
struct StageEvents {
    Event begin, wake, generate, extend, shade, connect;
};

class Backend {
public:
    virtual ~Backend() = default;

    // Puts the stages of a round into queues of the device.
    virtual Status launch(const Round& round, StageEvents& events) = 0;
    // Checks what came back with a round that has ended, round by round; fails only where there is a bug.
    virtual Status check_round(const RoundCounters&, std::span<const rp_block_demand> /*demand*/) { return {}; }
    // Whether a slot can have a camera ray that has not been traced at all between two rounds.
    virtual bool leaves_untraced_camera_rays() const { return false; }
    // Whether shadow rays are traced while extension rays are, in a queue of their own.
    virtual bool connects_concurrently() const { return false; }
    // The next round looks at every slot. REQUIRES: no round is under way.
    virtual Status wake_all_slots() = 0;
    // From the next round on, so many free slots (1, 2, 4 or 8) are given out at once, where that decides about speed.
    virtual void fill_together(uint32_t /*slots*/) {}
    // The log of blocks that rays entered, where it is kept (abi/visits.h). REQUIRES: no round is under way.
    virtual Status read_visits(std::vector<uint32_t>& /*words*/) { return Status::failed("visits are not recorded"); }

protected:
    Backend(Device& device, const rp_render_params& params, const GeometryBuffers& geometry, const WavefrontBuffers& buffers)
        : device_(device), params_(params), geometry_(geometry), buffers_(buffers) {}

    struct Wanted {
        Kernel& kernel;
        KernelName name;
    };
    // Those whose programs take longest to build come first.
    Status get_kernels(std::span<const Wanted> kernels) {
        std::vector<KernelName> names;
        for (const Wanted& wanted : kernels) names.push_back(wanted.name);
        device_.build_ahead(names);
        for (const Wanted& wanted : kernels) {
            auto kernel = device_.kernel(wanted.name);
            if (!kernel) return kernel.status();
            wanted.kernel = std::move(*kernel);
        }
        return {};
    }
    Status set_generate(Kernel& generate, const Round& round) const {
        const WavefrontBuffers& b = buffers_;
        const uint32_t more = round.more_later ? 1 : 0;
        if (params_.adaptive_error > 0)
            return generate.set(b.params, b.counters, b.free_list, b.slots.status(), b.slots.planes(), b.queue, round.numbers, b.again,
                                round.listed_again, more, b.stage_pixels);
        return generate.set(b.params, b.counters, b.free_list, b.slots.status(), b.slots.planes(), b.queue, round.numbers, b.again,
                            round.listed_again, more);
    }

    // items: work-items that take so many words of marks in a row.
    Status launch_report(const Round& round, uint64_t items, uint32_t group, uint32_t together) {
        const WavefrontBuffers& b = buffers_;
        RAYPAGER_TRY(report_.set(b.counters, geometry_.demand(), geometry_.block_count(), b.reports.buffer(), round.report, together));
        return device_.kernels().launch(report_, items, group);
    }

    Kernel report_;
    Device& device_;
    const rp_render_params& params_;
    const GeometryBuffers& geometry_;
    const WavefrontBuffers& buffers_;
};

}  // namespace raypager
