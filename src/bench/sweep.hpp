// One scene rendered at a list of memory limits, policies, path counts and connection rules, each against one reference. Repeats are
// interleaved (all variants once, then all again), so that a machine that gets slower in between slows all of them.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "bench/reference.hpp"
#include "render/render.hpp"
#include "store/block_source.hpp"

namespace raypager::bench {

struct SweepLimit {
    uint64_t bytes = 0;  // 0: given as a percentage of the geometry
    double percent = 0;
};

// What decides on residency: a policy, or a baseline with settings of its own (baselines.hpp).
struct SweepPolicy {
    enum class Baseline { none, paper, host };
    PolicyKind kind = PolicyKind::aged_wants;
    Baseline baseline = Baseline::none;
    std::string name() const;
};

struct SweepPaths {
    uint32_t count = 0;      // 0: see per_pixel
    uint32_t per_pixel = 0;  // 0: the engine's choice
    std::string name() const;
};

struct SweepSettings {
    RenderOptions base;  // all that does not vary
    std::vector<SweepLimit> limits;
    std::vector<SweepPolicy> policies;
    std::vector<SweepPaths> paths;
    std::vector<Connection> connections;
    uint32_t repeats = 3;
    double first_snapshot = 0.05;   // seconds; points of the convergence curve
    double snapshot_growth = 1.25;  // later ones farther apart
    ReferenceSettings reference;
};

struct SweepVariant {
    SweepLimit limit;
    SweepPolicy policy;
    SweepPaths paths;
    Connection connection = Connection::queue;
    std::string limit_name() const;     // "12.5%", "700 MiB"
    std::string settings_name() const;  // all but the limit; what is the engine's default is left out
};

struct ConvergencePoint {
    double seconds = 0;  // of rendering, without what the measurement itself took
    double spp = 0, rmse = 0;
    uint64_t bytes_loaded = 0;
};

struct SweepRun {
    size_t variant = 0;
    uint32_t repeat = 0;
    RenderReport report;
    double seconds = 0;                         // report.seconds.render without snapshots
    double wall_seconds = 0;                    // that the run took with everything around it
    std::vector<ConvergencePoint> convergence;  // the last one is the finished picture
    // When blocks came and went; kept for the first repeat only.
    std::vector<PagingEvent> journal;
    std::vector<float> round_seconds;
};

struct SweepResult {
    std::vector<SweepVariant> variants;
    std::vector<SweepRun> runs;  // repeat by repeat
    bool stopped = false;        // before all of them were done
    Reference reference;
    uint64_t geometry_bytes = 0;
    std::vector<std::string> different_films;  // one line each; runs whose film must be the same as an earlier one's and is not
};

// Every combination once. A baseline that fixes a setting is not repeated over it.
std::vector<SweepVariant> sweep_variants(const SweepSettings& settings);
// How many runs that makes.
size_t run_count(const SweepSettings& settings);
// Seconds for the runs that are still to come, by what those of the same variant took, or all of them on average; nothing before there is one.
std::optional<double> seconds_left(const SweepSettings& settings, const std::vector<SweepRun>& done);

struct SweepHooks {
    std::function<void(const std::string&)> note;                          // what is being done, a line each; may be empty
    std::function<Status(const SweepRun&, const SweepVariant&)> finished;  // after each run that was made; may be empty; an error ends the sweep
    const std::atomic<bool>* stop = nullptr;                               // the run under way is given up soon after it becomes true
};
// earlier: runs that need not be made again.
Result<SweepResult> run_sweep(const BlockSource& file, const SweepSettings& settings, const std::vector<SweepRun>& earlier, const SweepHooks& hooks);

// Films of runs with the same connection rule and number of samples must have the same hash. A line for each that differs.
std::vector<std::string> find_different_films(const std::vector<SweepVariant>& variants, const std::vector<SweepRun>& runs);

}  // namespace raypager::bench
