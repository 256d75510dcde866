// Where items go that are sorted by group, by all threads, each item behind those of its group that came before it.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "base/huge_pages.hpp"
#include "base/parallel.hpp"

namespace raypager {

class GroupPlaces {
public:
    // group_of(i): the group of item i, below `groups`; it is asked for once. piece: items that a thread takes at a time.
    // REQUIRES: groups <= 65536, count < 2^32.
    template <class GroupOf>
    GroupPlaces(size_t count, size_t groups, size_t piece, const GroupOf& group_of)
        : piece_(piece), group_of_(count), next_((count + piece - 1) / piece), begins_(groups + 1) {
        parallel_for(count, piece, [&](size_t begin, size_t end) {
            // Not in memory beside that of other threads: they would wait for one another's writes.
            std::vector<uint32_t> counts(groups);
            for (size_t i = begin; i < end; i++) {
                const auto group = static_cast<uint16_t>(group_of(i));
                group_of_[i] = group;
                counts[group]++;
            }
            next_[begin / piece] = std::move(counts);
        });
        uint32_t place = 0;
        for (size_t group = 0; group < groups; group++) {
            begins_[group] = place;
            for (auto& of_piece : next_) place += std::exchange(of_piece[group], place);
        }
        begins_[groups] = place;
    }

    // The first place of a group; that of the group behind the last one is the number of items.
    uint32_t begin(size_t group) const { return begins_[group]; }
    // Calls put(item, place) for all of them, in any order, on all cores.
    template <class Put>
    void put_all(const Put& put) const {
        parallel_for(group_of_.size(), piece_, [&](size_t begin, size_t end) {
            std::vector<uint32_t> next = next_[begin / piece_];  // a copy: see above
            for (size_t i = begin; i < end; i++) put(i, next[group_of_[i]]++);
        });
    }

private:
    const size_t piece_;
    UnwrittenVector<uint16_t> group_of_;
    std::vector<std::vector<uint32_t>> next_;  // by piece and group: the place of the next item
    std::vector<uint32_t> begins_;
};

}  // namespace raypager
