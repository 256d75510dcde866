#include <gtest/gtest.h>

#include "render/memory_plan.hpp"
#include "render/plan.hpp"
#include "wavefront/sample_order.hpp"

namespace raypager {
namespace {

MemoryNeeds ordinary() {
    MemoryNeeds needs;
    needs.limit = 1 << 30;
    needs.fixed = 10 << 20;
    needs.per_slot = 100;
    needs.geometry = 100 << 20;
    needs.largest_block = 4 << 20;
    needs.default_slots = 1 << 16;
    needs.max_chosen_slots = 1 << 22;
    needs.max_slot_bytes = 2 * needs.geometry;
    needs.total_paths = uint64_t{1} << 40;
    return needs;
}

TEST(MemoryPlan, everything_fits) {
    const auto plan = plan_memory(ordinary());
    ASSERT_TRUE(plan.ok());
    EXPECT_EQ(plan->pool_bytes, 100u << 20);
    EXPECT_EQ(plan->slots, 1u << 16);
}

TEST(MemoryPlan, preferred_slots_only_where_everything_stays_resident) {
    MemoryNeeds needs = ordinary();
    needs.preferred_slots = 1 << 18;
    EXPECT_EQ(plan_memory(needs)->slots, 1u << 18);
    const uint64_t tight = needs.fixed + needs.geometry + needs.largest_block;
    uint64_t before = 0;
    for (uint64_t limit = tight + 7 * (uint64_t{1} << 20); limit < tight + (30 << 20); limit += 777777) {
        needs.limit = limit;
        const auto plan = plan_memory(needs);
        ASSERT_TRUE(plan.ok());
        EXPECT_EQ(plan->pool_bytes, needs.geometry) << limit;
        EXPECT_GE(plan->slots, std::max<uint64_t>(before, 1 << 16));
        before = plan->slots;
    }
    EXPECT_EQ(before, 1u << 18);
    // With less, no more than without them.
    needs.limit = tight;
    const uint64_t slots = plan_memory(needs)->slots;
    needs.preferred_slots = 0;
    EXPECT_EQ(slots, plan_memory(needs)->slots);
}

TEST(MemoryPlan, never_over_the_limit_and_always_room_for_the_largest_block) {
    for (uint64_t limit = 14 << 20; limit < 300 << 20; limit += 1234567)
        for (const uint64_t slots : {uint64_t{0}, uint64_t{5000}}) {
            MemoryNeeds needs = ordinary();
            needs.limit = limit;
            needs.requested_slots = slots;
            const auto plan = plan_memory(needs);
            const uint64_t smallest = needs.fixed + needs.largest_block + needs.per_slot * (slots ? slots : min_slots);
            ASSERT_EQ(plan.ok(), limit >= smallest) << limit;
            if (!plan.ok()) {
                EXPECT_NE(plan.status().message().find(std::to_string(smallest)), std::string::npos) << plan.status().message();
                continue;
            }
            EXPECT_LE(needs.fixed + plan->slots * needs.per_slot + plan->pool_bytes, limit);
            EXPECT_GE(plan->pool_bytes, needs.largest_block);
            EXPECT_GE(plan->slots, min_slots);
        }
}

TEST(MemoryPlan, geometry_limits_bound_the_pool) {
    MemoryNeeds needs = ordinary();
    needs.geometry_limit_percent = 25;
    EXPECT_EQ(plan_memory(needs)->pool_bytes, 25u << 20);
    needs.geometry_limit_percent = 1;
    EXPECT_EQ(plan_memory(needs)->pool_bytes, 4u << 20);  // raised to the largest block
    needs.geometry_limit_percent = 0;
    needs.geometry_limit = 7 << 20;
    EXPECT_EQ(plan_memory(needs)->pool_bytes, 7u << 20);
    needs.geometry_limit = 1 << 20;
    EXPECT_FALSE(plan_memory(needs).ok());
}

TEST(MemoryPlan, more_rays_in_flight_when_blocks_must_be_swapped) {
    MemoryNeeds needs = ordinary();
    needs.geometry_limit_percent = 25;
    needs.default_slots = 1 << 20;
    needs.preferred_slots = 1 << 24;
    // Of room that the pool may not have: a quarter, if that is not more than what slots may take ...
    EXPECT_EQ(plan_memory(needs)->slots, (200u << 20) / 100);
    needs.limit = 513 << 20;
    needs.largest_block = 1 << 20;
    EXPECT_EQ(plan_memory(needs)->slots, ((513u - 10 - 1 - 25) << 20) / 4 / 100);
    // ... nor than the most slots that are to be chosen.
    needs.per_slot = 10;
    needs.default_slots = 1 << 16;
    EXPECT_EQ(plan_memory(needs)->slots, 1u << 22);
    needs.max_chosen_slots = 1 << 23;
    EXPECT_EQ(plan_memory(needs)->slots, 1u << 23);
    needs.max_slot_bytes = 60 << 20;
    EXPECT_EQ(plan_memory(needs)->slots, (60u << 20) / 10);
    needs = ordinary();
    needs.geometry_limit_percent = 25;
    // ... or all of it, if that is not more than half of the scene's bytes.
    needs.limit = needs.fixed + (25 << 20) + (20 << 20) + needs.largest_block;
    EXPECT_EQ(plan_memory(needs)->slots, (20u << 20) / 100);
    // Where they compete with the pool: a sixth.
    needs.limit = needs.fixed + (40 << 20) + needs.largest_block;
    EXPECT_EQ(plan_memory(needs)->slots, (100u << 20) / 6 / 100);
    needs.geometry_limit_percent = 0;  // whatever it is that makes the pool small
    needs.limit = needs.fixed + (80 << 20) + needs.largest_block;
    EXPECT_EQ(plan_memory(needs)->slots, (100u << 20) / 6 / 100);
    needs.default_slots = 1 << 14;  // not more than four times the ordinary number
    EXPECT_EQ(plan_memory(needs)->slots, 1u << 16);
    needs.total_paths = 40000;
    EXPECT_EQ(plan_memory(needs)->slots, 10000u);
}

TEST(MemoryPlan, large_films_are_there_in_parts) {
    MemoryNeeds needs = ordinary();
    needs.limit = 100 << 20;
    needs.fixed = 4 << 20;
    needs.film = 40 << 20;
    needs.geometry = 30 << 20;
    needs.largest_block = 1 << 20;
    EXPECT_EQ(plan_memory(needs)->film_bytes, 40u << 20);  // what cannot be divided
    needs.film_part = 1 << 20;
    EXPECT_EQ(plan_memory(needs)->film_bytes, 40u << 20);  // less than half
    needs.max_film = 30 << 20;
    EXPECT_EQ(plan_memory(needs)->film_bytes, 20u << 20);  // two equal parts
    needs.max_film = UINT64_MAX;
    needs.film = 50 << 20;
    EXPECT_EQ(plan_memory(needs)->film_bytes, 50u << 20);  // pool and slots take 36.3 MiB, and have no use for more
    needs.geometry = 60 << 20;
    EXPECT_EQ(plan_memory(needs)->film_bytes, 25u << 20);  // two parts, of at most the 29.7 MiB that are spare
    needs.geometry = 200 << 20;
    EXPECT_EQ(plan_memory(needs)->film_bytes, 17u << 20);  // three, of at most a quarter of 96 MiB
    needs.whole_film = true;
    EXPECT_EQ(plan_memory(needs)->film_bytes, 50u << 20);
    needs.film = 95 << 20;
    EXPECT_EQ(plan_memory(needs)->film_bytes, 24u << 20) << "which does not fit";
    needs.whole_film = false;
    needs.film = 50 << 20;
    needs.requested_slots = 900000;
    EXPECT_EQ(plan_memory(needs)->film_bytes, 9u << 20);  // of 96 MiB, 85.8 are for slots, 1 is for a block
}

// Down to one part and the fewest slots, or those that are asked for.
TEST(MemoryPlan, parts_of_films_are_never_over_the_limit) {
    for (const uint64_t slots : {uint64_t{0}, uint64_t{200000}})
        for (const uint64_t part : {uint64_t{4} << 10, uint64_t{1} << 20}) {
            MemoryNeeds needs = ordinary();
            needs.film = uint64_t{8} << 30;
            needs.film_part = part;
            needs.requested_slots = slots;
            const uint64_t smallest = needs.fixed + part + (slots ? slots : min_slots) * needs.per_slot + needs.largest_block;
            for (uint64_t limit = smallest - 1000; limit < smallest + (200 << 20); limit += limit < smallest + 1000 ? 100 : 777777) {
                needs.limit = limit;
                const auto plan = plan_memory(needs);
                ASSERT_EQ(plan.ok(), limit >= smallest) << limit;
                if (!plan.ok()) {
                    EXPECT_NE(plan.status().message().find(std::to_string(smallest)), std::string::npos) << plan.status().message();
                    continue;
                }
                EXPECT_LE(needs.fixed + plan->film_bytes + plan->slots * needs.per_slot + plan->pool_bytes, limit);
                EXPECT_EQ(plan->film_bytes % part, 0u);
            }
        }
}

TEST(MemoryPlan, slots_that_are_far_only_where_loads_are_dearer) {
    MemoryNeeds needs = ordinary();
    needs.limit = uint64_t{4} << 30;
    needs.preferred_slots = 1 << 24;
    needs.geometry_limit_percent = 50;
    const uint64_t all = plan_memory(needs)->slots;
    ASSERT_GT(all, 1u << 20);
    needs.cached_slots = 1 << 18;
    needs.slots_for_loads = 1.0 / 54;
    EXPECT_EQ(plan_memory(needs)->slots, 1u << 18);
    // The fewer blocks stay, the more slots; and in proportion to the scene.
    uint64_t before = 0;
    for (const double percent : {12.5, 6.0, 4.0}) {
        needs.geometry_limit_percent = percent;
        const uint64_t slots = plan_memory(needs)->slots;
        EXPECT_GE(slots, std::max<uint64_t>(before, 1 << 18)) << percent;
        before = slots;
    }
    EXPECT_NEAR(static_cast<double>(before), (100 << 20) / 0.04 / 54 / 100, 10);
    needs.geometry *= 2;
    EXPECT_NEAR(static_cast<double>(plan_memory(needs)->slots), 2.0 * static_cast<double>(before), 20);
    // Regions want half of them, but not fewer than twice of those that are near.
    const auto of_regions = [&](double percent) {
        needs.geometry_limit_percent = percent;
        needs.max_region_slots = 0;
        const uint64_t slots = plan_memory(needs)->slots;
        needs.max_region_slots = UINT64_MAX;
        const uint64_t fewer = plan_memory(needs)->slots;
        EXPECT_EQ(fewer, std::min<uint64_t>(slots, std::max<uint64_t>(slots / 2, 1 << 19))) << percent;
        return std::pair(slots, fewer);
    };
    for (const double percent : {12.5, 6.0, 4.0, 2.0}) of_regions(percent);
    EXPECT_EQ(of_regions(50).second, 1u << 18);
    const auto [few, as_few] = of_regions(8);
    EXPECT_GT(few, 1u << 18);
    EXPECT_EQ(as_few, few) << "between both";
    const auto [many, half] = of_regions(2);
    EXPECT_EQ(half, many / 2);
    needs.max_region_slots = 400000;
    EXPECT_EQ(plan_memory(needs)->slots, many) << "too short for half of them";
    needs.geometry_limit_percent = 6;
    EXPECT_EQ(plan_memory(needs)->slots, 400000u) << "regions are worth more";
    needs.max_region_slots = UINT64_MAX;
    // Never more than there were without.
    needs.geometry_limit_percent = 1;
    needs.cached_slots = 0;
    const uint64_t most = plan_memory(needs)->slots;
    needs.cached_slots = 1 << 18;
    needs.slots_for_loads = 1.0 / 54;
    EXPECT_LE(plan_memory(needs)->slots, most);
}

TEST(MemoryPlan, fewer_rays_in_flight_where_they_meet_fewer_blocks) {
    MemoryNeeds needs = ordinary();
    needs.geometry_limit_percent = 25;
    needs.preferred_slots = 1 << 24;
    const uint64_t slots = plan_memory(needs)->slots;
    needs.max_region_slots = slots / 2 - 1;
    EXPECT_EQ(plan_memory(needs)->slots, slots) << "too short";
    needs.max_region_slots++;
    EXPECT_EQ(plan_memory(needs)->slots, slots / 2);
    needs.default_slots = slots;
    EXPECT_EQ(plan_memory(needs)->slots, slots) << "enough to keep the device busy";
    needs = ordinary();
    needs.max_region_slots = UINT64_MAX;
    EXPECT_EQ(plan_memory(needs)->slots, 1u << 16) << "everything is resident";
}

TEST(MemoryPlan, a_geometry_limit_takes_no_more_in_all_than_everything_resident) {
    for (const uint32_t default_slots : {1u << 16, 1u << 20})
        for (const uint32_t preferred_slots : {0u, 1u << 18, 1u << 22})
            for (const uint64_t cached : {0u, 1u << 18})
                for (const double percent : {90.0, 50.0, 29.0, 12.5, 3.0, 0.1}) {
                    MemoryNeeds needs = ordinary();
                    needs.limit = uint64_t{64} << 30;
                    needs.default_slots = default_slots;
                    needs.preferred_slots = preferred_slots;
                    needs.cached_slots = cached;
                    needs.slots_for_loads = 1.0 / 54;
                    const auto taken = [&] {
                        const auto plan = plan_memory(needs);
                        return plan->pool_bytes + plan->slots * needs.per_slot;
                    };
                    const uint64_t resident = taken();
                    needs.geometry_limit_percent = percent;
                    EXPECT_LE(taken(), resident) << default_slots << ' ' << preferred_slots << ' ' << cached << ' ' << percent;
                }
}

TEST(MemoryPlan, memory_that_is_short_is_shared_by_halves_on_a_gpu) {
    MemoryNeeds needs = ordinary();
    needs.preferred_slots = 1 << 20;
    needs.max_region_slots = UINT64_MAX;
    needs.limit = needs.fixed + needs.largest_block + (80 << 20);
    EXPECT_EQ(plan_memory(needs)->slots, (40u << 20) / 100);
    needs.preferred_slots = 1 << 17;
    EXPECT_EQ(plan_memory(needs)->slots, 1u << 17) << "no more than are of use";
    needs.preferred_slots = 1 << 20;
    needs.cached_slots = 1 << 17;  // a CPU
    EXPECT_EQ(plan_memory(needs)->slots, 1u << 17);
}

TEST(SlotUse, slots_are_given_out_together_as_far_as_few_rays_wait) {
    const MemoryNeeds needs = ordinary();
    const auto together = [&](uint64_t pool, uint32_t region) {
        rp_sample_order order = make_order(16, 16, 64, 640 * 360, region);
        return filled_together(order, {pool, 1 << 16}, needs);
    };
    EXPECT_EQ(together(needs.geometry, 0), 8u);
    EXPECT_EQ(together(needs.geometry - 1, 0), 1u);
    EXPECT_EQ(together(needs.geometry - 1, 1000), 4u) << "to begin with";
    EXPECT_EQ(filled_together(0.0), 4u);
    EXPECT_EQ(filled_together(0.09), 4u);
    EXPECT_EQ(filled_together(0.1), 2u);
    EXPECT_EQ(filled_together(0.59), 2u);
    EXPECT_EQ(filled_together(0.6), 1u);
    EXPECT_EQ(filled_together(20.0), 1u) << "a ray may wait more than once";
}

TEST(SlotUse, regions_are_half_as_large_where_blocks_are_swapped) {
    const MemoryNeeds needs = ordinary();
    const rp_sample_order order = make_order(16, 16, 64, 640 * 360);
    const uint64_t pixels = 640 * 360, slots = 256 * 1024;
    const uint32_t whole = chosen_region(order, {needs.geometry, slots}, needs, pixels),
                   half = chosen_region(order, {needs.geometry / 2, slots}, needs, pixels);
    EXPECT_EQ(whole, default_region(order, slots, pixels));
    EXPECT_EQ(half, whole / 2);
    EXPECT_GT(chosen_region(order, {needs.geometry / 2, 1}, needs, pixels), 0u) << "not none, since there are some";
    EXPECT_EQ(chosen_region(order, {needs.geometry / 2, pixels * 64}, needs, pixels), 0u) << "too short for regions";
}

TEST(BlockNotes, each_policy_gets_what_it_goes_by) {
    const uint32_t many = 1 << 24, few = 1 << 16;
    const auto notes = [](PolicyKind kind, BlockForm form, uint32_t slots) { return block_notes(kind).definitions(form, slots); };
    EXPECT_EQ(notes(PolicyKind::aged_wants, BlockForm::stored, many), " -DRP_TRACK_ENTERS=255u");
    EXPECT_EQ(notes(PolicyKind::aged_wants, BlockForm::stored, few), " -DRP_TRACK_ENTERS=0u");
    EXPECT_EQ(notes(PolicyKind::aged_wants, BlockForm::wide, many), " -DRP_TRACK_ENTERS=0u");
    EXPECT_EQ(notes(PolicyKind::lru, BlockForm::stored, many), " -DRP_TRACK_LAST_ROUND");
    EXPECT_EQ(notes(PolicyKind::most_wanted, BlockForm::stored, many), " -DRP_TRACK_BOUNCES -DRP_TRACK_LAST_ROUND");
    EXPECT_EQ(BlockNotes().definitions(BlockForm::stored, many), "");
    EXPECT_EQ(BlockNotes().definitions(BlockForm::wide, many), " -DRP_TRACK_ENTERS=0u") << "no kernels of their own";
}

}  // namespace
}  // namespace raypager
