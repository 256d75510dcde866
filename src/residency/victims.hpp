// The blocks that may go, the least needed first.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "residency/policy.hpp"

namespace raypager {

// Finds as many as are asked for. Those that rest are in order already; the others are looked at when no more of these are left.
class Victims {
public:
    Victims(const PolicySettings& settings, const PolicyInput& input);
    // The one behind the last that is to go, and how many are behind that one; nullptr: there is none.
    const BlockState* next(size_t behind = 0);
    // The next ones go. REQUIRES: they have been asked for.
    void take(size_t count, std::vector<uint32_t>& evict);

private:
    // A block, and how much it is needed: the first number that differs says it. The greatest, which goes first, is needed least.
    struct Candidate {
        double need;
        uint32_t then[3];
        uint32_t block() const { return then[2]; }
        bool operator<(const Candidate& other) const;
    };
    Candidate candidate(uint32_t block) const;
    bool may_go(uint32_t block) const { return input_.blocks[block].resident_since <= input_.round; }
    bool find_resting();
    bool find_other();
    void list_others();

    const PolicySettings& settings_;
    const PolicyInput& input_;
    std::vector<uint32_t> order_;  // as far as they have been asked for
    size_t taken_ = 0;
    std::vector<size_t> front_;      // of the heap of those that rest, as a heap: places whose parents have been looked at
    std::vector<Candidate> others_;  // a heap
    bool others_listed_ = false;
};

}  // namespace raypager
