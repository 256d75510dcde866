// Changes of the page table on their way to the device as arguments of kernels (abi/block.h).
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "raypager/abi/block.h"
#include "raypager/abi/path.h"

namespace raypager {

// Takes the first of them, as many as there is room for.
inline rp_page_changes take_changes(std::span<const rp_page>& changes) {
    rp_page_changes argument;
    for (rp_page& page : argument.pages) page = {RP_NONE, 0, 0, RP_NONE};
    const size_t count = std::min<size_t>(changes.size(), RP_PAGE_CHANGES);
    std::copy_n(changes.begin(), count, argument.pages);
    changes = changes.subspan(count);
    return argument;
}

// Arguments of rp_begin_round.
struct RoundBegin {
    rp_page_changes changes;
    uint32_t named;  // how many of the names, or RP_NONE: all blocks are to be asked
    std::array<uint32_t, RP_MAX_NAMED> names{};
};

// The launches of rp_begin_round before a round, at least one: one work-item for those that name no block, as they wake nobody. Where more blocks
// came than are worth their launches, the last one asks the table for them, which must be up to date by then. blocks: entries of the table.
inline std::vector<RoundBegin> round_begins(std::span<const rp_page> changes, std::span<const uint32_t> came, uint64_t blocks) {
    constexpr uint64_t asked_in_a_launch = 4096;  // so many entries are looked at in about the time that a launch takes
    const bool named = came.size() <= RP_MAX_NAMED * (1 + blocks / asked_in_a_launch);
    std::vector<RoundBegin> launches;
    while (changes.size() > (named ? RP_PAGE_CHANGES : 0)) launches.push_back({take_changes(changes), 0});
    if (!named) {
        launches.push_back({take_changes(changes), RP_NONE});
        return launches;
    }
    do {
        const auto names = came.first(std::min<size_t>(came.size(), RP_MAX_NAMED));
        launches.push_back({take_changes(changes), static_cast<uint32_t>(names.size())});
        std::copy(names.begin(), names.end(), launches.back().names.begin());
        came = came.subspan(names.size());
    } while (!came.empty());
    return launches;
}

}  // namespace raypager
