// What is known of one block between two rounds, and which blocks there is something to decide about.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/index_set.hpp"
#include "residency/slab_allocator.hpp"

namespace raypager {

enum class PageState : uint8_t { absent, loading, resident };

// What is known of one block when a round has ended.
struct BlockState {
    PageState state = PageState::absent;
    uint32_t bytes = 0;
    uint32_t requests = 0;         // rays that wait for it now
    uint32_t bounces = 0;          // rays of the last round that ended on its surfaces
    uint32_t last_used = 0;        // last round in which a ray entered it, as far as that is noted
    uint32_t entries = 0;          // of rays so far, as counted (counts_entries)
    double traffic = 0;            // entries, as counted, of the last rounds: of earlier ones less and less (PolicySettings::traffic_kept)
    uint32_t requested_since = 0;  // first round of the present run of rounds in which it was wanted; 0: not wanted
    uint32_t resident_since = 0;   // first round that could see it
    PoolAddress address;
};

// Where there are very many blocks, most are none of these.
struct ActiveBlocks {
    // A resident block, and when it was used last. As numbers, less is longer ago.
    using Rest = uint64_t;
    static constexpr Rest rest_of(uint32_t block, uint32_t last_used) { return uint64_t{last_used} << 32 | block; }
    static constexpr uint32_t block_of(Rest rest) { return static_cast<uint32_t>(rest); }
    static constexpr uint32_t last_used(Rest rest) { return static_cast<uint32_t>(rest >> 32); }

    IndexSet wanted, resident;  // those that rays wait for, whatever their state
    uint32_t loading = 0;
    // A heap with the least at its front (std::greater). Each resident block that is idle (is_idle) is in it with its last_used, maybe twice; who is
    // in it otherwise has left, or has been used since.
    std::vector<Rest> resting;

    ActiveBlocks() = default;
    explicit ActiveBlocks(std::span<const BlockState> blocks);  // by looking at all
    void add_resting(uint32_t block, uint32_t used);
    // Blocks that are in the heap as they are.
    static bool rests(const BlockState& block, Rest rest) { return block.state == PageState::resident && block.last_used == last_used(rest); }
    // Takes out what is at the front and does not rest, and all such when they are many.
    void tidy(std::span<const BlockState> blocks);
};

}  // namespace raypager
