// Where blocks lie in the pool: a few slabs, each with a list of free extents. Plain data without any device: a plan can try
// evictions and take them back. Sizes and offsets are multiples of RP_BLOCK_ALIGNMENT.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <tuple>
#include <vector>

namespace raypager {

struct PoolAddress {
    uint32_t slab = 0;
    uint64_t offset = 0;
    bool operator==(const PoolAddress&) const = default;
};

class SlabAllocator {
public:
    // Any number of slabs, with their sizes in bytes (rounded down to the alignment).
    explicit SlabAllocator(const std::vector<uint64_t>& slab_bytes);
    // The smallest free extent that is large enough (best fit), if there is one.
    std::optional<PoolAddress> allocate(uint64_t bytes);
    bool fits(uint64_t bytes) const;
    // Gives back what was allocated with these bytes. Returns the bytes of the free extent that it has become part of.
    uint64_t release(PoolAddress address, uint64_t bytes);
    void take_back(PoolAddress address, uint64_t bytes);  // undoes a release; REQUIRES: nothing was allocated since
    uint64_t free_bytes() const { return free_bytes_; }
    uint64_t capacity() const { return capacity_; }

private:
    using Extents = std::map<uint64_t, uint64_t>;  // of a slab: offset -> bytes, neighbours merged
    void add(uint32_t slab, uint64_t offset, uint64_t bytes);
    void remove(uint32_t slab, Extents::iterator extent);

    std::vector<Extents> free_;
    std::set<std::tuple<uint64_t, uint32_t, uint64_t>> by_size_;  // the same: bytes, slab, offset
    uint64_t free_bytes_ = 0, capacity_ = 0;
};

}  // namespace raypager
