// The whole job for those who measure and test it: a render from any source of blocks, with what is not for users.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "device/hooks.hpp"
#include "raypager/abi/scene.h"
#include "raypager/session.hpp"
#include "residency/block_table.hpp"
#include "residency/demand_trace.hpp"
#include "store/block_source.hpp"
#include "wavefront/sample_numbers.hpp"

namespace raypager {

// What only tests and measurements set. None of it changes the picture, but for parts, which leave samples out.
struct RenderInstruments {
    bool keep_journal = false;  // fill MeasuredRender::journal and round_seconds
    uint64_t record_paths = 0;  // about so many paths are recorded in MeasuredRender::trace; 0: none
    // The largest slab of the pool, so that small scenes fill several; and how many threads load.
    uint64_t slab_bytes = 0;
    uint32_t loader_threads = 0;                                  // 0: what suits the device
    std::optional<uint32_t> read_ahead_threads;                   // none: what suits the device
    uint32_t rounds_under_way = 0;                                // 1 or 2; 0: what suits the device
    std::optional<uint32_t> evict_ahead;                          // as PolicySettings has it
    uint32_t visit_events = 0;                                    // that the log of recorded paths has room for; 0: as many as suit
    bool whole_film = false;                                      // on the device wherever it fits, though more would be left without
    std::shared_ptr<DeviceHooks> device_hooks;                    // null: none
    std::vector<std::shared_ptr<DeviceHooks>> more_device_hooks;  // where there are several devices: those of the second and so on
    // Which parts of the render are begun: ascending, none of them empty, at least one. Asked once slots and regions are chosen, which are those of
    // the whole render. Blocks stay from part to part. Not with adaptive sampling, nor with checkpoints. Empty: all of it.
    std::function<std::vector<SampleRange>(const rp_render_params&)> parts;
};

struct MeasuredRender : RenderResult {
    // If asked for: when which block came and went, in the order of rounds, and when each round ended (round r at index r - 1).
    std::vector<PagingEvent> journal;
    std::vector<float> round_seconds;
    std::optional<DemandTrace> trace;  // if asked for
};

Result<MeasuredRender> render(const BlockSource& scene, const RenderOptions& options, const RenderCallbacks& callbacks,
                              const RenderInstruments& instruments = {});

}  // namespace raypager
