// The main job: a baked scene in, a film out, with geometry paged through a pool on the device.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "device/profile.hpp"
#include "image/image.hpp"
#include "raypager/scene.hpp"
#include "raypager/status.hpp"
#include "residency/block_table.hpp"
#include "residency/demand_trace.hpp"
#include "residency/policy_names.hpp"
#include "store/block_source.hpp"
#include "wavefront/traversal.hpp"

namespace raypager {

class DeviceHooks;

enum class Connection { queue, roulette };  // shadow rays in a queue of their own, or the paper's choice (3.3)

// What camera rays see that meet nothing, instead of the scene's infinite light. Other rays meet that light as ever.
struct Background {
    bool transparent = false;  // the picture has a fourth channel, alpha; colours are premultiplied
    Float3 color;              // radiance, if not transparent
};

struct CheckpointOptions {
    std::filesystem::path file;  // empty: no checkpoints
    double every_seconds = 60;   // and at the end, however it comes
    bool resume = false;         // go on from the file if it is there; otherwise it must not be there
};

struct RenderOptions {
    std::string device;                       // index or part of a name; empty: the default device
    uint64_t memory_limit = 0;                // all device memory of the process, in bytes; 0: Device::default_limit
    uint64_t geometry_limit = 0;              // the pool, in bytes; 0: no limit of its own
    double geometry_limit_percent = 0;        // of the scene's geometry bytes; 0: not given. A percentage is raised to the largest block.
    uint64_t host_limit = 0;                  // cache of stored blocks in host memory; 0: half of the memory, if so much is free
    uint32_t spp = 0, width = 0, height = 0;  // 0: as the scene says
    std::optional<uint32_t> max_depth;
    double time_seconds = 0;  // stop after about so long, at the end of a pass or a group of them; 0: no limit
    uint32_t seed = 0;
    uint32_t paths = 0;  // path slots; 0: chosen from the limits
    PolicyKind policy = PolicyKind::aged_wants;
    Connection connection = Connection::queue;
    Traversal traversal = Traversal::automatic;
    std::optional<Camera> camera;
    std::optional<Background> background;  // none: what shines there
    double progress_seconds = 0.5;         // between calls of progress
    double snapshot_seconds = 0;           // between calls of snapshot; 0: never
    double snapshot_growth = 1;            // each interval between snapshots is longer by this factor than the one before
    // For measurements; the defaults are the best known.
    ProfileChanges tuning;                   // of what suits the device
    uint32_t loads_in_flight = 0;            // while blocks must be evicted for them; 0: the default of the policy
    std::optional<double> hold_above_ready;  // PolicySettings::hold_above_ready, 0 to 1
    bool wait_for_loads = false;             // every round waits for the loads that were started before it, as in the paper
    uint32_t tile_size = 16;                 // camera paths start in tiles of so many pixels a side, 1 to 1024
    // So many samples of a pixel are begun one after the other, at most, 1 to 64; 0: up to 16, but 1 if the time decides how many there are, or
    // pictures are looked at before the end, as with snapshots and checkpoints.
    uint32_t together = 0;
    // So many pixels get all their samples before the next ones begin (rp_sample_order); 0: all of them at once. If not given, long renders whose
    // samples begin together choose it by their path slots.
    std::optional<uint32_t> region;
    PoolPlace pool_place = PoolPlace::device;
    bool keep_journal = false;  // fill RenderResult::journal and round_seconds
    uint64_t record_paths = 0;  // about so many paths are recorded in RenderResult::trace; 0: none
    // For tests: the largest slab of the pool, so that small scenes fill several; and how many threads load.
    uint64_t slab_bytes = 0;
    uint32_t loader_threads = 0;                 // 0: what suits the device
    std::optional<uint32_t> read_ahead_threads;  // none: what suits the device
    uint32_t rounds_under_way = 0;               // 1 or 2; 0: what suits the device
    std::optional<uint32_t> evict_ahead;         // for tests: as PolicySettings has it
    uint32_t visit_events = 0;                   // for tests: that the log of recorded paths has room for; 0: as many as suit
    std::shared_ptr<DeviceHooks> device_hooks;   // for tests: null: none
    CheckpointOptions checkpoint;
    double stall_seconds = 30;  // a render that makes no progress for so long says so; 0: never
    // Set from outside. stop: end soon, with an even picture. Few more samples begin, so that every pixel gets one, and paths under way may finish
    // for stop_seconds; with a checkpoint, which keeps all work, the render ends after the round under way. stop_now: end after that round in any
    // case.
    const std::atomic<bool>*stop = nullptr, *stop_now = nullptr;
    double stop_seconds = 1.5;
};

// Counts and seconds include those of the runs before a checkpoint that the render went on from.
struct RenderProgress {
    double seconds = 0;           // of rendering, snapshots included
    double snapshot_seconds = 0;  // of these: spent on snapshots by this run
    double spp = 0;               // samples a pixel, on average: begun (progress), finished (snapshot)
    double fraction = 0;          // of the job
    uint64_t rays = 0;
    double rays_per_second = 0;  // over the last interval
    uint64_t loads = 0, bytes_loaded = 0;
    uint64_t resident_bytes = 0, geometry_bytes = 0;
};

// Rays, paging and seconds.render, .stall, .trace: of all runs together, if the render went on from a checkpoint.
struct RenderReport {
    struct DeviceFacts {
        std::string name, platform, driver, type;
    } device;
    struct Limits {
        uint64_t memory_bytes = 0, geometry_bytes = 0, host_bytes = 0;
    } limits, peak;
    uint32_t width = 0, height = 0, spp = 0, max_depth = 0, paths = 0, seed = 0;
    uint32_t tile_size = 0, together = 0, region = 0;  // as RenderOptions has them; those of its checkpoint, if the render went on from one
    std::string policy, connection;
    BlockForm form = BlockForm::stored;  // of the blocks on the device
    uint64_t film_hash = 0;
    bool complete = true;    // false: stopped from outside before its time, and pixels may have different numbers of samples; then
    double average_spp = 0;  // ... spp is this rounded down, ...
    uint64_t unsampled = 0;  // ... and so many pixels have none: they show what is around them
    struct Checkpoint {
        uint64_t runs = 1;     // that the picture took
        uint32_t written = 0;  // by this run
        double seconds = 0;    // of this run, spent on writing them
        std::string advice;    // how to go on from the last one; empty: there is none
    } checkpoint;
    struct Seconds {
        double total = 0, render = 0, stall = 0, build = 0;  // build: of the kernels
        double trace = 0;                                    // kernels on the device, the sum of, but for what ran side by side, ...
        std::array<double, 5> stages{};                      // ... wake, generate, extend (streams: and connect), shade, connect
        double snapshots = 0;                                // of render: what the snapshots took
    } seconds;
    struct Rays {
        uint64_t camera = 0, bounce = 0, shadow = 0;
        uint64_t total() const { return camera + bounce + shadow; }
    } rays;
    struct Paging {
        uint64_t loads = 0, evictions = 0, bytes_loaded = 0, rounds = 0, wants_without_hit = 0;
    } paging;
    uint64_t clamped_samples = 0;
};

struct RenderResult {
    Image image;
    RenderReport report;
    // If asked for: when which block came and went, in the order of rounds, and when each round ended (round r at index r - 1).
    std::vector<PagingEvent> journal;
    std::vector<float> round_seconds;
    std::optional<DemandTrace> trace;  // if asked for
};

struct RenderCallbacks {
    std::function<void(const RenderProgress&)> progress;            // may be empty
    std::function<Status(Image&, const RenderProgress&)> snapshot;  // may be empty, may change the picture; an error ends the render
    std::function<void(const std::string&)> warning;                // a line for the user, from any thread; empty: to stderr
    std::function<void()> begins;                                   // before the first round: from now on there is work to lose; may be empty
};

Result<RenderResult> render(const BlockSource& scene, const RenderOptions& options, const RenderCallbacks& callbacks);

}  // namespace raypager
