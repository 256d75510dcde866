// Finds equal items among many that lie in an array of their own.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "raypager/abi/types.h"

namespace raypager {

class IndexTable {
public:
    // The item that equal(index) accepts; or, if there is none, `next`, which is remembered. hash: of what is looked for. hash_of(index): of an item
    // that is remembered.
    template <class HashOf, class Equal>
    uint32_t find_or_add(uint64_t hash, uint32_t next, const HashOf& hash_of, const Equal& equal) {
        if (2 * (count_ + 1) > slots_.size()) grow(hash_of);
        size_t at = place(hash);
        for (; slots_[at] != RP_NONE; at = (at + 1) & (slots_.size() - 1))
            if (equal(slots_[at])) return slots_[at];
        slots_[at] = next;
        ++count_;
        return next;
    }

private:
    size_t place(uint64_t hash) const { return static_cast<size_t>(mixed(hash)) & (slots_.size() - 1); }
    static uint64_t mixed(uint64_t hash) {
        hash = (hash ^ hash >> 32) * 0x9e3779b97f4a7c15u;
        return (hash ^ hash >> 29) * 0xbf58476d1ce4e5b9u >> 20;
    }
    template <class HashOf>
    void grow(const HashOf& hash_of) {
        std::vector<uint32_t> old(slots_.empty() ? 64 : 2 * slots_.size(), RP_NONE);
        old.swap(slots_);
        for (const uint32_t index : old) {
            if (index == RP_NONE) continue;
            size_t at = place(hash_of(index));
            while (slots_[at] != RP_NONE) at = (at + 1) & (slots_.size() - 1);
            slots_[at] = index;
        }
    }

    std::vector<uint32_t> slots_;
    size_t count_ = 0;
};

}  // namespace raypager
