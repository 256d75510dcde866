// The replay of demand traces: what it must do by hand on small ones, and what must hold for all.
#include <gtest/gtest.h>

#include <bit>

#include "bench/bounds.hpp"
#include "bench/policy_bench.hpp"
#include "bench_traces.hpp"

namespace raypager::bench {
namespace {

ReplaySettings settings_for(const DemandTrace& trace, PolicyKind kind, uint64_t pool_bytes, uint32_t slots) {
    ReplaySettings settings;
    settings.policy = default_settings(kind);
    settings.pool_bytes = std::max<uint64_t>(pool_bytes, trace.largest_block());
    settings.slots = slots;
    settings.visit_seconds = 1e-6;
    return settings;
}

// Extension rays, each with the blocks that it enters; a path each.
DemandTrace paths_of(uint32_t blocks, const std::vector<std::vector<uint32_t>>& rays) {
    DemandTrace trace;
    trace.block_bytes.assign(blocks, 64);
    for (const auto& ray : rays) {
        trace.rays.push_back({trace.visits.size(), static_cast<uint32_t>(ray.size()), false, ray.empty() ? RP_NONE : ray.back()});
        for (const uint32_t block : ray) trace.visits.push_back(Visit::of(block, false));
        trace.path_rays.push_back(trace.rays.size());
    }
    trace.recorded.paths = rays.size();
    trace.recorded.slots = 1;
    return trace;
}

TEST(Replay, loads_once_what_fits) {
    const DemandTrace trace = paths_of(3, {{0, 1}, {1}, {}, {2, 0}});
    const ReplayResult result = replay(trace, settings_for(trace, PolicyKind::aged_wants, 3 * 64, 2));
    EXPECT_EQ(result.loads, 3u);
    EXPECT_EQ(result.bytes_loaded, 3u * 64);
    EXPECT_EQ(result.evictions, 0u);
    EXPECT_EQ(result.rays, 4u);
    EXPECT_EQ(result.peak_resident_bytes, 3u * 64);
}

TEST(Replay, one_slot_and_one_block_serve_path_after_path) {
    const DemandTrace trace = paths_of(3, {{0, 1, 2}, {0, 1, 2}});
    const ReplayResult result = replay(trace, settings_for(trace, PolicyKind::lru, 64, 1));
    EXPECT_EQ(result.loads, 6u);  // nothing can be shared
    const ReplayResult together = replay(trace, settings_for(trace, PolicyKind::lru, 64, 2));
    EXPECT_EQ(together.loads, 3u);  // both paths wait for the same block
}

// A shadow ray enters its blocks in their order, and the first that stops it ends it without the others.
TEST(Replay, a_shadow_ray_ends_with_the_first_block_that_stops_it) {
    const auto loads = [](const std::vector<Visit>& shadow) {
        DemandTrace trace = paths_of(4, {{2}});
        trace.rays.push_back({trace.visits.size(), static_cast<uint32_t>(shadow.size()), true, RP_NONE});
        trace.visits.insert(trace.visits.end(), shadow.begin(), shadow.end());
        trace.path_rays.back() = trace.rays.size();
        return replay(trace, settings_for(trace, PolicyKind::lru, 4 * 64, 1)).loads;
    };
    EXPECT_EQ(loads({Visit::of(2, true), Visit::of(0, false), Visit::of(1, false)}), 1u);
    EXPECT_EQ(loads({Visit::of(0, false), Visit::of(1, true), Visit::of(3, false)}), 3u);
    EXPECT_EQ(loads({Visit::of(0, false), Visit::of(1, false), Visit::of(3, false)}), 4u);
    // What lies behind an absent block is not looked at, though it is there and would stop the ray.
    EXPECT_EQ(loads({Visit::of(0, false), Visit::of(2, true), Visit::of(3, false)}), 2u);
}

TEST(Replay, time_follows_bandwidth) {
    const DemandTrace trace = paths_of(4, {{0}, {1}, {2}, {3}});
    ReplaySettings settings = settings_for(trace, PolicyKind::lru, 64, 1);
    const ReplayResult fast = replay(trace, settings);
    settings.bandwidth = 64;  // a block a second
    const ReplayResult slow = replay(trace, settings);
    EXPECT_EQ(slow.loads, fast.loads);
    EXPECT_NEAR(slow.stall, 4, 0.01);
    EXPECT_LT(fast.seconds, 0.01);
}

TEST(Replay, every_policy_ends_within_its_pool_and_serves_every_ray) {
    for (const uint64_t seed : {11, 12, 13})
        for (const PolicyName& policy : policy_names)
            for (const double share : {0.0, 0.2, 0.6, 1.0})
                for (const uint32_t slots : {1u, 7u, 100u}) {
                    const DemandTrace trace = random_trace(seed);
                    const auto pool = static_cast<uint64_t>(share * static_cast<double>(trace.geometry_bytes()));
                    ReplaySettings settings = settings_for(trace, policy.kind, pool, slots);
                    settings.rounds_under_way = 1 + seed % 2;
                    SCOPED_TRACE(testing::Message() << "seed " << seed << ", " << policy.name << ", pool " << settings.pool_bytes << ", " << slots);
                    const ReplayResult result = replay(trace, settings);
                    EXPECT_EQ(result.rays, trace.rays.size());
                    EXPECT_LE(result.peak_resident_bytes, settings.pool_bytes);
                    EXPECT_GE(result.loads, result.evictions);
                    // No schedule can do with less than either bound.
                    EXPECT_LE(min_bytes(trace, slots, settings.pool_bytes), result.bytes_loaded);
                    // The service orders' sums tell of every round.
                    EXPECT_EQ(result.service.begin.size(), result.rounds + 1);
                }
}

TEST(Replay, is_the_same_every_time) {
    const DemandTrace trace = random_trace(20, {.paths = 2000});
    for (const PolicyName& policy : policy_names) {
        ReplaySettings settings = settings_for(trace, policy.kind, trace.geometry_bytes() / 4, 64);
        settings.rounds_under_way = 2;
        const ReplayResult a = replay(trace, settings), b = replay(trace, settings);
        EXPECT_EQ(std::tuple(a.loads, a.bytes_loaded, a.rounds, a.visits, a.seconds),
                  std::tuple(b.loads, b.bytes_loaded, b.rounds, b.visits, b.seconds));
        EXPECT_EQ(a.service.blocks, b.service.blocks);
    }
}

TEST(Bounds, furthest_next_use_by_hand) {
    // Belady's example with room for two: 0 1 2 0 1: 0 and 1 come, 2 replaces 1 (used after 0), then 1 comes again.
    const ServiceOrder service{{0, 1, 2, 0, 1}, {0, 1, 2, 3, 4, 5}};
    const std::vector<uint32_t> bytes(3, 64);
    EXPECT_EQ(furthest_next_use_bytes(service, bytes, 128), 4u * 64);
    EXPECT_EQ(furthest_next_use_bytes(service, bytes, 192), 3u * 64);
    // Blocks of the same round are needed together.
    EXPECT_EQ(furthest_next_use_bytes({{0, 1, 2, 0, 1}, {0, 2, 3, 5}}, bytes, 128), 4u * 64);
}

// The fewest loads over all choices of victims, by trying them all. State: set of resident blocks as bits.
uint64_t fewest_loads(const ServiceOrder& service, size_t blocks, size_t room) {
    std::vector<uint64_t> cost(size_t{1} << blocks, UINT64_MAX);
    cost[0] = 0;
    for (size_t round = 0; round + 1 < service.begin.size(); round++) {
        size_t needed = 0;
        for (uint64_t i = service.begin[round]; i < service.begin[round + 1]; i++) needed |= size_t{1} << service.blocks[i];
        std::vector<uint64_t> next(cost.size(), UINT64_MAX);
        for (size_t from = 0; from < cost.size(); from++) {
            if (cost[from] == UINT64_MAX) continue;
            const size_t all = from | needed;
            const uint64_t loads = cost[from] + static_cast<uint64_t>(std::popcount(needed & ~from));
            // Any part of what was there may stay.
            for (size_t kept = all;; kept = (kept - 1) & all) {
                if ((kept & needed) == needed && std::popcount(kept) <= static_cast<int>(room)) next[kept] = std::min(next[kept], loads);
                if (kept == 0) break;
            }
        }
        cost = std::move(next);
    }
    return *std::min_element(cost.begin(), cost.end());
}

TEST(Bounds, furthest_next_use_is_the_best_for_equal_blocks) {
    for (const uint64_t seed : {31, 32, 33, 34}) {
        const DemandTrace trace = random_trace(seed, {.blocks = 7, .paths = 60, .equal_sizes = true});
        const ReplayResult result = replay(trace, settings_for(trace, PolicyKind::lru, 3 * 640, 5));
        const uint64_t clairvoyant = furthest_next_use_bytes(result.service, trace.block_bytes, 3 * 640);
        EXPECT_LE(clairvoyant, result.bytes_loaded) << "seed " << seed;
        EXPECT_EQ(clairvoyant, 640 * fewest_loads(result.service, 7, 3)) << "seed " << seed;
    }
}

TEST(Bounds, min_bytes_by_hand) {
    // Path after path needs another block of four; one path at a time, room for one block: each path costs a load, but for repetitions
    // of a block that the pool may hold.
    std::vector<std::vector<uint32_t>> rays;
    for (uint32_t i = 0; i < 400; i++) rays.push_back({i % 4});
    const DemandTrace trace = paths_of(4, rays);
    const uint64_t least = min_bytes(trace, 1, 64);
    EXPECT_LE(least, 400u * 64);
    EXPECT_GE(least, 150u * 64);  // far above the four blocks that have to come once
    EXPECT_EQ(min_bytes(trace, 400, 4 * 64), 4u * 64);
}

TEST(PolicyBench, rows_come_in_order_and_the_check_replays_the_recording) {
    DemandTrace trace = random_trace(40, {.paths = 1000});
    PolicyBenchSettings settings;
    settings.pools = {trace.geometry_bytes(), trace.geometry_bytes() / 4, 1};
    settings.policies = {PolicyKind::lru, PolicyKind::sweep};
    const auto rows = bench_policies(trace, settings, {});
    ASSERT_EQ(rows.size(), 6u);
    for (size_t i = 0; i < rows.size(); i++) {
        EXPECT_EQ(rows[i].policy, settings.policies[i % 2]);
        EXPECT_EQ(rows[i].pool_bytes, std::max<uint64_t>(settings.pools[i / 2], trace.largest_block()));
        EXPECT_LE(rows[i].least, rows[i].replay.bytes_loaded);
        EXPECT_EQ(rows[i].least, rows[i / 2 * 2].least);
    }
    EXPECT_LE(rows[0].replay.bytes_loaded, rows[2].replay.bytes_loaded);
    const ReplayResult recorded = replay(trace, recorded_settings(trace));
    trace.recorded.bytes_loaded = 2 * recorded.bytes_loaded;
    EXPECT_DOUBLE_EQ(check_replay(trace).bytes_ratio, 0.5);
    trace.recorded.paths *= 4;                       // as if a quarter had been recorded
    EXPECT_EQ(recorded_settings(trace).slots, 13u);  // a quarter of 50, rounded
}

}  // namespace
}  // namespace raypager::bench
