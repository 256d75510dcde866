#include "render/memory_plan.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "base/words.hpp"

namespace raypager {
namespace {

uint64_t pool_limit(const MemoryNeeds& needs) {
    uint64_t limit = needs.geometry;
    if (needs.geometry_limit) limit = std::min(limit, needs.geometry_limit);
    if (needs.geometry_limit_percent > 0) {
        const auto share = static_cast<uint64_t>(static_cast<double>(needs.geometry) * needs.geometry_limit_percent / 100);
        limit = std::min(limit, std::max(share, needs.largest_block));
    }
    return limit;
}

// Slots whose bytes are a certain part of the scene's over the share that is resident.
uint64_t slots_for_loads(const MemoryNeeds& needs, uint64_t pool) {
    const double geometry = static_cast<double>(needs.geometry);
    const double bytes = geometry / static_cast<double>(std::max<uint64_t>(pool, 1)) * geometry * needs.slots_for_loads;
    return static_cast<uint64_t>(std::min(bytes / static_cast<double>(needs.per_slot), static_cast<double>(needs.max_chosen_slots)));
}

// With so many, a render that may have only a part of the geometry resident takes no more memory in all than one that has all of it.
uint64_t slots_instead_of_geometry(const MemoryNeeds& needs, uint64_t pool) {
    return std::max(needs.default_slots, needs.preferred_slots) + (needs.geometry - pool) / needs.per_slot;
}

uint64_t wanted_slots(const MemoryNeeds& needs, uint64_t pool, uint64_t left) {
    uint64_t slots = needs.default_slots;
    if (std::min(pool, left) < needs.geometry) {
        const uint64_t beside = left > pool ? left - pool : 0;
        const uint64_t for_slots = std::max(std::min(needs.geometry / 2, beside), std::min(needs.max_slot_bytes, beside / 4));
        slots =
            std::max({slots, std::min(needs.geometry / 6 / needs.per_slot, 4 * slots), std::min(for_slots / needs.per_slot, needs.max_chosen_slots)});
        if (needs.cached_slots) slots = std::min(slots, std::max(needs.cached_slots, slots_for_loads(needs, std::min(pool, left))));
        // On a CPU twice those that are near, unless that is too many for regions.
        const uint64_t at_least = std::min(2 * needs.cached_slots, std::max(needs.cached_slots, needs.max_region_slots));
        if (const uint64_t half = std::max({slots / 2, needs.default_slots, at_least}); half <= needs.max_region_slots) slots = std::min(slots, half);
        // Where memory is short, pool and slots of a GPU share it by halves (bench/journal/gpu-paging.md).
        if (needs.cached_slots == 0 && beside == 0) slots = std::max(slots, needs.preferred_slots);
        slots = std::min(slots, slots_instead_of_geometry(needs, std::min(pool, left)));
    } else {
        slots = std::max(slots, std::min(needs.preferred_slots, (left - needs.geometry) / needs.per_slot));
    }
    slots = std::min(slots, std::max(min_slots, needs.total_paths / 4));
    // Half of what is left, unless the pool needs less than the other half.
    const uint64_t room = left > pool ? std::max(left / 2, left - pool) : left / 2;
    return std::max(min_slots, std::min({slots, room / needs.per_slot, needs.max_slots}));
}

// left: beside what is fixed and the film.
MemoryPlan divide(const MemoryNeeds& needs, uint64_t left) {
    const uint64_t pool = pool_limit(needs);
    MemoryPlan plan;
    plan.slots = needs.requested_slots ? needs.requested_slots : wanted_slots(needs, pool, left - needs.largest_block);
    plan.pool_bytes = std::min(pool, left - plan.slots * needs.per_slot);
    return plan;
}

// Bytes of the film that are there at a time. others: that slots and blocks need at least.
uint64_t film_bytes(const MemoryNeeds& needs, uint64_t others) {
    const uint64_t left = needs.limit - std::min(needs.limit, needs.fixed), room = std::min(left - std::min(left, others), needs.max_film);
    if (needs.film_part == 0 || (needs.whole_film && needs.film <= room)) return needs.film;
    if (left < others) return std::min(needs.film, needs.film_part);
    const MemoryPlan without = divide(needs, left);
    const uint64_t spare = left - without.slots * needs.per_slot - without.pool_bytes;
    if (needs.film <= std::min(room, std::max(left / 2, spare))) return needs.film;
    const uint64_t parts = (needs.film + needs.film_part - 1) / needs.film_part;
    const uint64_t most = std::max<uint64_t>(1, std::min(room, std::max(left / 4, spare)) / needs.film_part), windows = (parts + most - 1) / most;
    return std::min(needs.film, (parts + windows - 1) / windows * needs.film_part);
}

}  // namespace

Result<MemoryPlan> plan_memory(const MemoryNeeds& needs) {
    const uint64_t fewest = needs.requested_slots ? needs.requested_slots : min_slots;
    const uint64_t others = fewest * needs.per_slot + needs.largest_block, film = film_bytes(needs, others), fixed = needs.fixed + film;
    const uint64_t smallest = fixed + others;
    if (needs.geometry_limit && needs.geometry_limit < needs.largest_block)
        return Status::failed(
            fmt::format("--geometry-limit {}: the largest block of the scene, or page of an image, has {}; give at least that, or bake with a "
                        "smaller --block-size",
                        format_bytes(needs.geometry_limit), format_exact_bytes(needs.largest_block)));
    if (smallest > needs.limit)
        return Status::failed(fmt::format(
            "the memory limit of {} is too small for this job; the smallest that would do is {}: {} for film and tables, {} for {}, {} for "
            "the largest block or page",
            format_bytes(needs.limit), format_exact_bytes(smallest), format_bytes(fixed), format_bytes(fewest * needs.per_slot),
            counted(fewest, "path slot"), format_bytes(needs.largest_block)));
    MemoryPlan plan = divide(needs, needs.limit - fixed);
    plan.film_bytes = film;
    return plan;
}

}  // namespace raypager
