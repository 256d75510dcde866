// A render: a baked scene in, a picture out, with geometry paged through a pool on the device. The picture is the same to the bit whatever the
// limits are, and a render always ends. Messages of errors call options what the command line calls them: --memory-limit is memory_limit.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "raypager/blocks.hpp"
#include "raypager/film_layers.hpp"
#include "raypager/peers.hpp"
#include "raypager/picture.hpp"
#include "raypager/scene.hpp"
#include "raypager/status.hpp"
#include "raypager/tuning.hpp"

namespace raypager {

// Shadow rays have a queue of their own, or take turns with continuing paths by roulette (the paper, 3.3). Decides how noisy a picture is.
enum class Connection { queue, roulette };

// What camera rays see that meet nothing, instead of the scene's infinite light. Other rays meet that light as ever.
struct Background {
    bool transparent = false;  // the picture has a fourth channel, alpha; colours are premultiplied
    Float3 color;              // radiance, if not transparent
};

struct CheckpointOptions {
    std::filesystem::path file;  // empty: no checkpoints
    double every_seconds = 60;   // and at the end, however it comes
    bool resume = false;         // go on from the file if it is there; false: the file must not exist yet
};

// What paths do is recorded, for 'raypager bench policy'.
struct RecordOptions {
    std::filesystem::path file;  // empty: nothing is recorded. Written when the picture is complete.
    uint64_t paths = 500000;     // about so many of all paths, spread evenly
};

struct RenderOptions {
    std::string device;  // index or part of a name (devices.hpp); empty: the default device
    // All device memory of the render, in bytes. 0: three quarters of what the device has; on a CPU half of main memory, or less if less is free.
    // More than the device has is a usage error; too little fails, and the message names the smallest limit that would do.
    uint64_t memory_limit = 0;
    // Of the blocks on the device, in bytes, and in percent of all of them; 0: not given. The smaller one counts. Bytes below the largest block are
    // refused, a percentage is raised to it.
    uint64_t geometry_limit = 0;
    double geometry_limit_percent = 0;
    bool allow_different = false;             // several devices may be of different kinds: then the last bits of the picture depend on chance
    uint64_t host_limit = 0;                  // cache of stored blocks in host memory, in bytes; 0: half of the memory, if so much is free
    uint32_t spp = 0, width = 0, height = 0;  // samples per pixel; pixels. 0: as the scene says
    // More than 0: adaptive sampling, with at most spp samples per pixel. After 16 samples, and each time that their number has doubled, those pixels
    // go on whose standard error is still above adaptive_error times the picture's mean luminance times sqrt(n / spp), with n samples so far. Pixels
    // get different numbers of samples (FilmLayer::samples), but the same ones whatever the limits are. With time_seconds it ends when either says
    // so.
    double adaptive_error = 0;
    std::optional<uint32_t> max_depth;  // scattering events of a path
    double time_seconds = 0;            // stop after about so long, at the end of a pass (one sample of each pixel) or of some passes; 0: no limit
    uint32_t seed = 0;
    std::optional<Camera> camera;          // none: the scene's, as it is; for a picture of another shape see fit_camera()
    std::optional<Background> background;  // none: what shines there
    FilmLayers layers;                     // that the film is to keep beside the picture
    Connection connection = Connection::queue;
    CheckpointOptions checkpoint;
    RecordOptions record;
    double progress_seconds = 0.5;  // between calls of RenderCallbacks::progress
    double snapshot_seconds = 0;    // between calls of RenderCallbacks::snapshot; 0: never
    double snapshot_growth = 1;     // each interval between snapshots is longer by this factor than the one before
    double stall_seconds = 30;      // a render that makes no progress for so long says so; 0: never
    // Set from outside, and there as long as the render. stop: end soon, but evenly: only those samples still begin that every pixel needs to
    // have one, and paths in flight get stop_seconds to finish; with a checkpoint, which keeps all work, the render ends after the current round.
    // stop_now: end after that round in any case.
    const std::atomic<bool>*stop = nullptr, *stop_now = nullptr;
    double stop_seconds = 1.5;
    // For who watches: the first sample of each pixel is begun coarse to fine, at points that are far apart first, and each step before the next. The
    // finished picture is the same. Not with adaptive_error, checkpoint.file and record.file.
    bool coarse_first = false;
    RenderTuning tuning;
    // Other processes that render the same picture; null: none. All are given the same scene and options, and call the same functions: of Session's,
    // create, step, done, progress and finish. Rank 0 gets the picture, writes checkpoints and snapshots, and reports; the others get empty ones.
    std::shared_ptr<Peers> peers;
};

// How a view differs from that of RenderOptions.
struct SessionView {
    std::optional<Camera> camera;    // none: as it was
    uint32_t width = 0, height = 0;  // pixels; 0: as they were
};

// How a block is doing.
struct BlockStatus {
    enum class State : uint8_t { absent, on_its_way, resident };
    State state = State::absent;
    uint32_t waiting_rays = 0;
};

// Counts and seconds include those of the runs before a checkpoint that the render went on from; on rank 0 of several processes, those of all.
struct RenderProgress {
    double seconds = 0;           // of rendering, snapshots included
    double snapshot_seconds = 0;  // of these: spent on snapshots by this run
    double spp = 0;               // samples per pixel, on average: begun (progress), finished (snapshot)
    double finished_spp = 0;      // of those begun, about so many have ended, after the last round
    double fraction = 0;          // of the job
    uint64_t rays = 0;
    double rays_per_second = 0;  // over the last interval
    uint64_t loads = 0, bytes_loaded = 0;
    uint64_t resident_bytes = 0, geometry_bytes = 0, pool_bytes = 0;  // the last: that may be resident; on all devices together
    struct Device {
        uint32_t rank = 0, index = 0;                                          // of the process; as in --device
        uint64_t samples = 0, rays = 0, bytes_loaded = 0, resident_bytes = 0;  // samples: begun
    };
    std::vector<Device> devices;  // that render, by this run
};

// Rays, paging and seconds.render, .stall, .trace: of all runs together, if the render went on from a checkpoint; all but .render of all devices
// together, too.
struct RenderReport {
    struct DeviceFacts {
        std::string name, platform, driver, type;
    } device;  // the first one
    // What each did in this run; of several devices without those that have failed.
    struct DeviceFigures {
        uint32_t rank = 0, index = 0;  // of the process; as in --device
        uint64_t samples = 0, rays = 0, loads = 0, evictions = 0, bytes_loaded = 0, rounds = 0, texture_waits = 0;
        uint64_t peak_memory_bytes = 0, peak_geometry_bytes = 0;
        double trace_seconds = 0, stall_seconds = 0, build_seconds = 0;
    };
    struct DeviceWork : DeviceFigures {
        DeviceFacts facts;
    };
    std::vector<DeviceWork> devices;
    // Of each process, where there are several: bytes of blocks in its memory for all, bytes that its cache has asked for, by where they came from,
    // answers of others that came late or damaged, and bytes of blocks in host memory at most, the cache's among them.
    struct Rank {
        uint64_t kept_bytes = 0, from_memory = 0, from_peers = 0, from_file = 0, late = 0, damaged = 0, peak_host_bytes = 0;
    };
    std::vector<Rank> ranks;
    struct Limits {
        uint64_t memory_bytes = 0, geometry_bytes = 0, host_bytes = 0;
    } limits, peak;  // peak: of the device, and the process, that had most
    uint32_t width = 0, height = 0, spp = 0, max_depth = 0, paths = 0, seed = 0;
    uint32_t tile_size = 0, together = 0, region = 0;  // as RenderTuning has them; those of its checkpoint, if the render went on from one
    uint32_t film_rows = 0;                            // whose film was on the device at a time: all, or as many as the memory limit leaves room for
    std::string policy, connection;
    BlockForm form = BlockForm::stored;  // of the blocks on the device
    uint64_t film_hash = 0;              // of the sums in the film: the same for the same picture, whatever its layers
    FilmLayers layers;
    uint64_t layers_hash = 0;  // of those, but for waits; 0: there are none
    bool complete = true;      // false: stopped from outside before its time, and pixels may have different numbers of samples; then
    double average_spp = 0;    // ... spp is this rounded down, ...
    uint64_t unsampled = 0;    // ... and so many pixels have none: they show what is around them
    struct Checkpoint {
        uint64_t runs = 1;     // that the picture took
        uint32_t written = 0;  // by this run
        double seconds = 0;    // of this run, spent on writing them
        std::string advice;    // how to go on from the last one; empty: there is none
    } checkpoint;
    struct Seconds {
        // stall: no kernel ran on the device while rays waited for blocks. build: of the kernels.
        double total = 0, render = 0, stall = 0, build = 0;
        double trace = 0;                // of all stages on the device; what ran side by side counts once
        std::array<double, 5> stages{};  // the parts: wake, generate, extend (streams: and connect), shade, connect
        double snapshots = 0;            // of render: what the snapshots took
    } seconds;
    struct Rays {
        uint64_t camera = 0, bounce = 0, shadow = 0;
        uint64_t total() const { return camera + bounce + shadow; }
    } rays;
    struct Paging {
        uint64_t loads = 0, evictions = 0, bytes_loaded = 0, rounds = 0;
        uint64_t requests_without_hit = 0;  // rays that waited for a block and hit nothing in it
        uint64_t texture_waits = 0;         // times that a path waited for a page of a texture or of the sky, of this run alone
    } paging;
    uint64_t clamped_samples = 0;
    uint64_t recorded_paths = 0;  // in the file of RecordOptions
};

struct RenderResult {
    Image image;
    std::vector<FilmLayerImage> layers;  // those of RenderOptions::layers, in the order of FilmLayer
    RenderReport report;
};

// All may be empty. All but warning are called from the thread that renders, between two rounds.
struct RenderCallbacks {
    std::function<void(const RenderProgress&)> progress;
    // Picture and layers so far, which may be changed; an error ends the render.
    std::function<Status(Image&, std::vector<FilmLayerImage>&, const RenderProgress&)> snapshot;
    std::function<void(const std::string&)> warning;  // a line for the user, from any thread; empty: to stderr
    std::function<void()> begins;                     // before the first round: from now on there is work to lose
};

// Renders from start to end.
Result<RenderResult> render(const Blocks& scene, const RenderOptions& options, const RenderCallbacks& callbacks = {});

// A render that its owner drives. All functions but cancel() are to be called from one thread at a time; after an error, only the destructor.
class Session {
public:
    // Opens the device, divides its memory, allocates and builds kernels, or goes on from a checkpoint. An error says which limit would do.
    static Result<Session> create(const Blocks& scene, const RenderOptions& options, const RenderCallbacks& callbacks = {});
    ~Session();
    Session(Session&&) noexcept;
    Session& operator=(Session&&) noexcept;

    // Whether the picture is finished, or the render was cancelled.
    bool done() const;
    // Traces rays for about so many seconds, at least one round, unless it is done.
    Status step(double seconds);
    RenderProgress progress() const;
    // The picture so far: pixels without a sample show what is around them. Rendering goes on as if nothing had happened. spp: how many samples per
    // pixel are finished, on average.
    Result<Image> snapshot(double* spp = nullptr);
    // What the film keeps of a pixel, as images of one pixel: those of RenderOptions::layers. REQUIRES: x and y lie in the picture.
    Result<std::vector<FilmLayerImage>> layers_at(uint32_t x, uint32_t y);
    // In the order of Blocks::bounds, after the last round.
    std::vector<BlockStatus> blocks() const;
    // Begins anew with another view, of at most as many pixels as the session was created with. Blocks and kernels on the device stay; counts and
    // seconds begin at 0. Not with a checkpoint, a recording, or a film that is on the device in parts. After a usage error it goes on as before.
    Status restart(const SessionView& view);
    // Goes on with another RenderOptions::geometry_limit and geometry_limit_percent: the picture is the same as with one limit from start to end.
    // Blocks come anew. What is too little is a usage error that says so, as is a film that is on the device in parts; then it goes on as before.
    Status limit_geometry(uint64_t bytes, double percent);
    // Writes the checkpoint now. A usage error without RenderOptions::checkpoint.
    Status checkpoint();
    // From any thread: step() returns soon, after at most one round; what has been rendered stays.
    void cancel();
    // Ends the render, wherever it is, with a last checkpoint if there are any: picture and report. To be called once.
    Result<RenderResult> finish();

private:
    struct State;
    explicit Session(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace raypager
