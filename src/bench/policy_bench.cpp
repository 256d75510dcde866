#include "bench/policy_bench.hpp"

#include <algorithm>
#include <atomic>

#include "base/parallel.hpp"
#include "bench/bounds.hpp"

namespace raypager::bench {
namespace {

ReplaySettings row_settings(const DemandTrace& trace, const PolicyBenchSettings& bench, const PolicyRow& row) {
    ReplaySettings settings = recorded_settings(trace);
    const uint64_t average = trace.block_bytes.empty() ? 0 : trace.geometry_bytes() / trace.block_bytes.size();
    DeviceProfile profile = profile_of_cores(trace.recorded.cpu_cores);
    apply(bench.tuning, profile);
    settings.policy = default_settings(row.policy, row.pool_bytes, average, profile);
    if (bench.loads_in_flight) settings.policy.loads_in_flight = settings.policy.loads_while_idle = bench.loads_in_flight;
    if (bench.hold_above_ready) settings.policy.hold_above_ready = *bench.hold_above_ready;
    settings.pool_bytes = row.pool_bytes;
    settings.slab_bytes = 0;
    settings.wait_for_loads = false;
    settings.rounds_under_way = profile.rounds_under_way;
    if (bench.slots) settings.slots = slots_of_share(trace, bench.slots);
    settings.bandwidth = bench.bandwidth;
    if (bench.ray_rate > 0) {
        const auto work = static_cast<double>(trace.visits.size() + trace.rays.size()), rays = static_cast<double>(trace.rays.size());
        settings.visit_seconds = rays / work / bench.ray_rate;
    }
    return settings;
}

double ratio(uint64_t a, uint64_t b) { return b ? static_cast<double>(a) / static_cast<double>(b) : 0; }

}  // namespace

ReplayCheck check_replay(const DemandTrace& trace) {
    ReplayCheck check;
    ReplaySettings settings = recorded_settings(trace);
    settings.pool_bytes = std::max<uint64_t>(settings.pool_bytes, trace.largest_block());
    check.replay = replay(trace, settings);
    check.replay.service = {};
    check.bytes_ratio = ratio(check.replay.bytes_loaded, trace.recorded.bytes_loaded);
    check.rounds_ratio = ratio(check.replay.rounds, trace.recorded.rounds);
    return check;
}

std::vector<PolicyRow> bench_policies(const DemandTrace& trace, const PolicyBenchSettings& bench, const std::function<void(double)>& progress) {
    std::vector<PolicyRow> rows;
    for (const uint64_t pool : bench.pools)
        for (const PolicyKind policy : bench.policies) {
            PolicyRow row;
            row.policy = policy;
            row.pool_bytes = std::max<uint64_t>(pool, trace.largest_block());
            rows.push_back(std::move(row));
        }
    std::vector<uint64_t> least(bench.pools.size());
    const size_t policies = bench.policies.size(), jobs = rows.size() + least.size();
    std::atomic<size_t> done{0};
    parallel_for(jobs, 1, [&](size_t job, size_t) {
        if (job < rows.size()) {
            PolicyRow& row = rows[job];
            row.replay = replay(trace, row_settings(trace, bench, row));
            row.clairvoyant = furthest_next_use_bytes(row.replay.service, trace.block_bytes, row.pool_bytes);
            row.replay.service = {};
        } else {
            const size_t pool = job - rows.size();
            const uint32_t slots = bench.slots ? slots_of_share(trace, bench.slots) : recorded_settings(trace).slots;
            least[pool] = min_bytes(trace, slots, std::max<uint64_t>(bench.pools[pool], trace.largest_block()));
        }
        if (progress) progress(static_cast<double>(++done) / static_cast<double>(jobs));
    });
    for (size_t i = 0; i < rows.size(); i++) rows[i].least = least[i / policies];
    return rows;
}

}  // namespace raypager::bench
