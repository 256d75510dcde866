// The paging policies as the pure functions that they are.
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <random>
#include <set>

#include "raypager/abi/path.h"
#include "residency/block_table.hpp"
#include "residency/policy.hpp"

namespace raypager {
namespace {

BlockState absent(uint32_t requests, uint32_t requested_since = 1, uint32_t bytes = 64) {
    BlockState block;
    block.bytes = bytes;
    block.requests = requests;
    block.requested_since = requests ? requested_since : 0;
    return block;
}

// Residents take their place from the pool.
BlockState resident(SlabAllocator& pool, uint32_t last_used, uint32_t bounces, uint32_t bytes = 64, uint32_t since = 1) {
    BlockState block;
    block.bytes = bytes;
    block.state = PageState::resident;
    block.last_used = last_used;
    block.bounces = bounces;
    block.resident_since = since;
    block.address = *pool.allocate(bytes);
    return block;
}

// So many that are resident, and as many that are wanted.
std::vector<BlockState> half_resident(SlabAllocator& pool, uint32_t half) {
    std::vector<BlockState> blocks;
    for (uint32_t i = 0; i < half; i++) blocks.push_back(resident(pool, i, 0));
    blocks.resize(2 * half, absent(5));
    return blocks;
}

Plan plan(PolicyKind kind, const std::vector<BlockState>& blocks, const SlabAllocator& pool, uint32_t round = 10) {
    return plan_paging(default_settings(kind), {blocks, ActiveBlocks(blocks), round, 0, 100}, pool);
}

TEST(Policy, loads_nothing_that_nobody_wants) {
    SlabAllocator pool({1024});
    EXPECT_TRUE(plan(PolicyKind::aged_wants, {absent(0), absent(0)}, pool).load.empty());
}

TEST(Policy, each_kind_has_its_first_load) {
    // Many wants but young; few but old; many a byte.
    const std::vector<BlockState> blocks = {absent(100, 10, 6400), absent(9, 1, 1280), absent(30, 10, 64), absent(1, 0 + 1, 64 * 3)};
    SlabAllocator pool({6400});
    EXPECT_EQ(plan(PolicyKind::most_wanted, blocks, pool).load.at(0).block, 0u);
    EXPECT_EQ(plan(PolicyKind::wanted_per_byte, blocks, pool).load.at(0).block, 2u);
    EXPECT_EQ(plan(PolicyKind::lru, blocks, pool).load.at(0).block, 1u);  // oldest; ties go to the lower index
    const std::vector<BlockState> aged = {absent(30, 100000, 64), absent(20, 1, 64)};
    EXPECT_EQ(plan(PolicyKind::aged_wants, aged, pool, 100000).load.at(0).block, 1u);  // 20 requests x 100000^(1/4) rounds > 16 x 30 x 1
    EXPECT_EQ(plan(PolicyKind::wanted_per_byte, {absent(30, 100, 64), absent(20, 1, 64)}, pool, 100).load.at(0).block, 0u);
}

// The order of many is that of floor(log2(requests age^(1/4) / bytes) / 6), then by turn.
TEST(Policy, aged_wants_come_by_a_coarse_logarithm) {
    const uint32_t seed = std::random_device{}();
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    constexpr uint32_t round = 100'000;
    for (int trial = 0; trial < 200; trial++) {
        std::vector<BlockState> blocks;
        for (int i = 0; i < 40; i++) blocks.push_back(absent(1 + random() % (1u << random() % 31), 1 + random() % round, 64 << random() % 20));
        std::vector<uint32_t> order(blocks.size());
        std::iota(order.begin(), order.end(), 0);
        const auto score = [&](uint32_t i) {
            const double rounds = double(round - blocks[i].requested_since) + 1;
            return std::floor(std::ilogb(blocks[i].requests * std::sqrt(std::sqrt(rounds)) / blocks[i].bytes) / 6.0);
        };
        std::stable_sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) { return score(a) > score(b); });
        PolicySettings settings = default_settings(PolicyKind::aged_wants);
        settings.loads_into_free = 100;
        const Plan plan = plan_paging(settings, {blocks, ActiveBlocks(blocks), round, 0, 100}, SlabAllocator({uint64_t{64} << 32}));
        ASSERT_EQ(plan.load.size(), blocks.size());
        for (size_t i = 0; i < order.size(); i++) ASSERT_EQ(plan.load[i].block, order[i]);
    }
}

// Nearly the same wants: one way through the scene, from where the last load was.
TEST(Policy, aged_wants_come_as_they_lie_in_space) {
    SlabAllocator pool({6400});
    const std::vector<BlockState> blocks = {absent(30, 10), absent(20, 10), absent(28, 10), absent(4000, 10)};
    const auto order = [&](uint32_t next_in_turn) {
        std::vector<uint32_t> loads;
        for (const PlannedLoad& load :
             plan_paging(default_settings(PolicyKind::aged_wants), {blocks, ActiveBlocks(blocks), 10, 0, 100, next_in_turn}, pool).load)
            loads.push_back(load.block);
        return loads;
    };
    EXPECT_EQ(order(0), (std::vector<uint32_t>{3, 0, 1, 2}));
    EXPECT_EQ(order(1), (std::vector<uint32_t>{3, 1, 2, 0}));
}

TEST(Policy, evicts_the_least_recently_used_or_the_least_bounced) {
    SlabAllocator pool({192});
    const std::vector<BlockState> blocks = {resident(pool, 9, 1), resident(pool, 3, 50), resident(pool, 8, 20), absent(5)};
    EXPECT_EQ(plan(PolicyKind::aged_wants, blocks, pool).evict, std::vector<uint32_t>{1});
    EXPECT_EQ(plan(PolicyKind::lru, blocks, pool).evict, std::vector<uint32_t>{1});
    EXPECT_EQ(plan(PolicyKind::most_wanted, blocks, pool).evict, std::vector<uint32_t>{0});
}

// In a round of millions of rays nearly every block is used: how much tells them apart.
TEST(Policy, evicts_what_the_fewest_rays_enter) {
    SlabAllocator pool({192});
    std::vector<BlockState> blocks = {resident(pool, 10, 1), resident(pool, 10, 1), resident(pool, 9, 1), absent(5)};
    blocks[0].traffic = 40, blocks[1].traffic = 3, blocks[2].traffic = 1000;
    EXPECT_EQ(plan(PolicyKind::aged_wants, blocks, pool).evict, std::vector<uint32_t>{1});
    EXPECT_EQ(plan(PolicyKind::lru, blocks, pool).evict, std::vector<uint32_t>{2});
}

TEST(Policy, never_evicts_what_no_round_has_seen) {
    SlabAllocator pool({64});
    const std::vector<BlockState> blocks = {resident(pool, 11, 0, 64, 11), absent(5)};
    const Plan held = plan(PolicyKind::aged_wants, blocks, pool, 10);
    EXPECT_TRUE(held.evict.empty());
    EXPECT_TRUE(held.load.empty());
    EXPECT_EQ(plan(PolicyKind::aged_wants, blocks, pool, 11).load.size(), 1u);
}

TEST(Policy, holds_evicting_loads_while_many_rays_are_ready) {
    SlabAllocator pool({64});
    const std::vector<BlockState> blocks = {resident(pool, 2, 0), absent(5)};
    const PolicySettings settings = default_settings(PolicyKind::aged_wants);
    EXPECT_TRUE(plan_paging(settings, {blocks, ActiveBlocks(blocks), 10, 50, 100}, pool).load.empty());
    EXPECT_EQ(plan_paging(settings, {blocks, ActiveBlocks(blocks), 10, 10, 100}, pool).load.size(), 1u);
    // Free space costs nothing.
    EXPECT_EQ(plan_paging(settings, {blocks, ActiveBlocks(blocks), 10, 50, 100}, SlabAllocator({128})).load.size(), 1u);
}

TEST(Policy, the_longest_wanted_comes_first_in_the_end) {
    SlabAllocator pool({64});
    const std::vector<BlockState> blocks = {absent(1000, 5000), absent(1, 1)};
    EXPECT_EQ(plan(PolicyKind::most_wanted, blocks, pool, 3000).load.at(0).block, 0u);
    EXPECT_EQ(plan(PolicyKind::most_wanted, blocks, pool, 5001).load.at(0).block, 1u);
}

TEST(Policy, on_demand_is_not_held_back) {
    SlabAllocator pool({64});
    const std::vector<BlockState> blocks = {resident(pool, 2, 0), absent(5)};
    EXPECT_EQ(plan_paging(default_settings(PolicyKind::lru), {blocks, ActiveBlocks(blocks), 10, 99, 100}, pool).load.size(), 1u);
}

TEST(Policy, sweep_loads_in_turn_whatever_is_wanted) {
    SlabAllocator pool({128});
    // Loaded in the order 2, 3; it is block 4's turn, then that of 0 and 1.
    std::vector<BlockState> blocks = {absent(0), absent(7), resident(pool, 10, 9), resident(pool, 1, 0), absent(0)};
    PolicySettings settings = default_settings(PolicyKind::sweep);
    settings.loads_in_flight = 1;
    const Plan first = plan_paging(settings, {blocks, ActiveBlocks(blocks), 10, 0, 100, 4}, pool);
    ASSERT_EQ(first.load.size(), 1u);
    EXPECT_EQ(first.load[0].block, 4u);
    EXPECT_EQ(first.evict, std::vector<uint32_t>{2});  // was there for longest, however much it is used
    const Plan second = plan_paging(settings, {blocks, ActiveBlocks(blocks), 10, 0, 100, 0}, pool);
    EXPECT_EQ(second.load.at(0).block, 0u);
    blocks[1].requests = 0;
    EXPECT_TRUE(plan_paging(settings, {blocks, ActiveBlocks(blocks), 10, 0, 100, 4}, pool).load.empty());  // nobody waits
}

TEST(Policy, room_is_made_ahead_for_those_that_come_next) {
    SlabAllocator pool({640});
    std::vector<BlockState> blocks = half_resident(pool, 10);
    PolicySettings settings = default_settings(PolicyKind::aged_wants);
    EXPECT_EQ(plan_paging(settings, {blocks, ActiveBlocks(blocks), 10, 0, 100}, pool).evict.size(), settings.loads_in_flight);
    settings.evict_ahead = 3;
    const Plan first = plan_paging(settings, {blocks, ActiveBlocks(blocks), 10, 0, 100}, pool);
    EXPECT_EQ(first.load.size(), settings.loads_in_flight);
    EXPECT_EQ(first.evict.size(), settings.loads_in_flight + 3);
    EXPECT_FALSE(first.load[0].was_free);
    for (const uint32_t block : first.evict) blocks[block].state = PageState::absent;
    for (const PlannedLoad& load : first.load) blocks[load.block].state = PageState::loading;
    const Plan second = plan_paging(settings, {blocks, ActiveBlocks(blocks), 11, 0, 100}, first.pool);
    ASSERT_EQ(second.load.size(), 3u);
    for (const PlannedLoad& load : second.load) EXPECT_TRUE(load.was_free);
    // While loads are held back, nobody goes for those to come.
    EXPECT_TRUE(plan_paging(settings, {blocks, ActiveBlocks(blocks), 11, 100, 100}, first.pool).evict.empty());
    // Nor while as many are under way as may be.
    EXPECT_TRUE(second.evict.empty());
    for (const PlannedLoad& load : second.load) blocks[load.block].state = PageState::loading;
    const Plan third = plan_paging(settings, {blocks, ActiveBlocks(blocks), 12, 0, 100}, second.pool);
    EXPECT_TRUE(third.load.empty() && third.evict.empty());
}

TEST(Policy, nobody_goes_for_room_that_is_there) {
    SlabAllocator pool({384});
    const std::vector<BlockState> blocks = half_resident(pool, 3);
    PolicySettings settings = default_settings(PolicyKind::aged_wants);
    settings.loads_into_free = 2;
    settings.evict_ahead = 3;
    const Plan plan = plan_paging(settings, {blocks, ActiveBlocks(blocks), 10, 0, 100}, pool);
    EXPECT_EQ(plan.load.size(), 2u);
    EXPECT_TRUE(plan.evict.empty());
}

TEST(Policy, loads_in_flight_follow_the_pool) {
    const auto loads = [](PolicyKind kind, uint64_t pool, uint32_t cores = 2) {
        return default_settings(kind, pool, 1000, profile_of_cores(cores)).loads_in_flight;
    };
    EXPECT_EQ(loads(PolicyKind::aged_wants, 1000), 2u);
    EXPECT_EQ(loads(PolicyKind::aged_wants, 80000), 5u);
    EXPECT_EQ(loads(PolicyKind::aged_wants, 1000000), 16u);
    EXPECT_EQ(loads(PolicyKind::aged_wants, 40000, 16), 8u);  // half as many as cores
    EXPECT_EQ(loads(PolicyKind::aged_wants, 10000, 16), 2u);  // but no more than a fifth of the pool
    EXPECT_EQ(loads(PolicyKind::aged_wants, 160000, 16), 10u);
    EXPECT_EQ(loads(PolicyKind::aged_wants, 1000000, 128), 16u);
    EXPECT_EQ(default_settings(PolicyKind::aged_wants, 80000, 1000, profile_of_cores(0)).loads_in_flight, 20u);
    EXPECT_EQ(default_settings(PolicyKind::aged_wants, 800000, 1000, profile_of_cores(0)).loads_in_flight, 64u);
    EXPECT_EQ(default_settings(PolicyKind::aged_wants, 80000, 1000, profile_of_cores(0)).evict_ahead, 5u);
    EXPECT_EQ(default_settings(PolicyKind::aged_wants, 800000, 1000, profile_of_cores(0)).evict_ahead, 16u);
    EXPECT_EQ(loads(PolicyKind::most_wanted, 1000000), 1u);                                       // the paper's one swap
    EXPECT_EQ(default_settings(PolicyKind::lru, 0, 0, profile_of_cores(2)).loads_in_flight, 2u);  // an empty scene
}

// While hardly any ray is ready, loads are all that is waited for.
TEST(Policy, more_loads_are_in_flight_while_the_device_is_idle) {
    const PolicySettings settings = default_settings(PolicyKind::aged_wants, 400 * 64, 64, profile_of_cores(0));
    EXPECT_EQ(settings.loads_while_idle, 128u);
    EXPECT_EQ(default_settings(PolicyKind::aged_wants, 80 * 64, 64, profile_of_cores(0)).loads_while_idle, 40u);  // half of the pool
    SlabAllocator pool({400 * 64});
    const std::vector<BlockState> blocks = half_resident(pool, 400);
    EXPECT_EQ(plan_paging(settings, {blocks, ActiveBlocks(blocks), 500, 20, 1000}, pool).load.size(), 64u);
    EXPECT_EQ(plan_paging(settings, {blocks, ActiveBlocks(blocks), 500, 19, 1000}, pool).load.size(), 128u);
}

// Of the blocks that are wanted and not loaded, those that come next, whether loads are held back or not.
TEST(Policy, tells_what_is_wanted_behind_the_loads) {
    SlabAllocator pool({10 * 64});
    std::vector<BlockState> blocks = half_resident(pool, 10);
    blocks[13].requests = 0;
    blocks[17].requests = 100000;
    const PolicySettings settings = default_settings(PolicyKind::aged_wants);
    const Plan held = plan_paging(settings, {blocks, ActiveBlocks(blocks), 20, 100, 100}, pool);
    EXPECT_TRUE(held.load.empty());
    ASSERT_EQ(held.behind.size(), 9u);
    EXPECT_EQ(held.behind[0], 17u);
    const Plan plan = plan_paging(settings, {blocks, ActiveBlocks(blocks), 20, 0, 100}, pool);
    std::set<uint32_t> told(plan.behind.begin(), plan.behind.end());
    EXPECT_EQ(told.size(), plan.behind.size());
    for (const PlannedLoad& load : plan.load) EXPECT_TRUE(told.insert(load.block).second);
    EXPECT_EQ(told, (std::set<uint32_t>{10, 11, 12, 14, 15, 16, 17, 18, 19}));
}

// Whatever the state: the plan fits, evicts only what may go, and makes progress when nothing else can.
TEST(Policy, random_states_give_sound_plans) {
    const uint64_t seed = 99;
    std::mt19937_64 random(seed);
    const auto below = [&](uint32_t n) { return static_cast<uint32_t>(random() % n); };
    for (int trial = 0; trial < 5000; trial++) {
        SCOPED_TRACE(testing::Message() << "seed " << seed << ", trial " << trial);
        const uint32_t largest = 64 * (1 + below(8)), slab = largest + 64 * below(20), round = 100;
        SlabAllocator pool(std::vector<uint64_t>(1 + below(3), slab));
        std::vector<BlockState> blocks;
        bool loading = false, unseen = false, wanted = false;
        for (uint32_t i = 0; i < 3 + below(30); i++) {
            BlockState block = absent(below(3) ? below(50) : 0, 1 + below(round), 64 * (1 + below(largest / 64)));
            const uint32_t fate = below(4);
            if (fate < 2)
                if (const auto place = pool.allocate(block.bytes)) {
                    block.state = below(10) == 0 ? PageState::loading : PageState::resident;
                    block.address = *place;
                    block.resident_since = block.state == PageState::resident && below(6) == 0 ? round + 1 : 1 + below(round);
                    block.last_used = below(round);
                    block.bounces = below(100);
                }
            loading |= block.state == PageState::loading;
            unseen |= block.state == PageState::resident && block.resident_since > round;
            wanted |= block.state == PageState::absent && block.requests > 0;
            blocks.push_back(block);
        }
        const PolicyKind kind = policy_names[below(policy_names.size())].kind;
        const auto turn = below(static_cast<uint32_t>(blocks.size()));
        PolicySettings settings = default_settings(kind);
        settings.evict_ahead = below(5);
        const Plan result = plan_paging(settings, {blocks, ActiveBlocks(blocks), round, 0, 1000, turn}, pool);
        SlabAllocator replay = pool;  // what the plan's pool must come to
        for (const uint32_t block : result.evict) {
            replay.release(blocks[block].address, blocks[block].bytes);
            EXPECT_EQ(blocks[block].state, PageState::resident);
            EXPECT_LE(blocks[block].resident_since, round);
        }
        EXPECT_EQ(std::set<uint32_t>(result.evict.begin(), result.evict.end()).size(), result.evict.size());
        // No two blocks overlap afterwards.
        std::vector<std::tuple<uint32_t, uint64_t, uint64_t>> extents;
        for (uint32_t i = 0; i < blocks.size(); i++)
            if (blocks[i].state != PageState::absent && std::find(result.evict.begin(), result.evict.end(), i) == result.evict.end())
                extents.emplace_back(blocks[i].address.slab, blocks[i].address.offset, blocks[i].bytes);
        for (const PlannedLoad& load : result.load) {
            EXPECT_EQ(blocks[load.block].state, PageState::absent);
            if (kind != PolicyKind::sweep) {
                EXPECT_GT(blocks[load.block].requests, 0u);
            }
            // Kernels may read what is evicted until the rounds that were started have ended.
            for (const BlockState& block : blocks) {
                if (!load.was_free || block.state == PageState::absent || block.address.slab != load.address.slab) continue;
                EXPECT_TRUE(load.address.offset + blocks[load.block].bytes <= block.address.offset ||
                            block.address.offset + block.bytes <= load.address.offset);
            }
            extents.emplace_back(load.address.slab, load.address.offset, blocks[load.block].bytes);
            replay.take_back(load.address, blocks[load.block].bytes);
        }
        EXPECT_EQ(result.pool.free_bytes(), replay.free_bytes());
        std::sort(extents.begin(), extents.end());
        for (size_t i = 0; i < extents.size(); i++) {
            const auto [in, offset, bytes] = extents[i];
            EXPECT_LE(offset + bytes, slab);
            if (i + 1 < extents.size() && std::get<0>(extents[i + 1]) == in) {
                EXPECT_LE(offset + bytes, std::get<1>(extents[i + 1]));
            }
        }
        if (wanted && !loading && !unseen) {
            EXPECT_FALSE(result.load.empty());
        }
    }
}

}  // namespace
}  // namespace raypager
