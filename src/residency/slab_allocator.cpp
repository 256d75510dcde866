#include "residency/slab_allocator.hpp"

#include "base/check.hpp"
#include "raypager/abi/block.h"

namespace raypager {
namespace {

uint64_t round_up(uint64_t bytes) { return (bytes + RP_BLOCK_ALIGNMENT - 1) / RP_BLOCK_ALIGNMENT * RP_BLOCK_ALIGNMENT; }

}  // namespace

SlabAllocator::SlabAllocator(const std::vector<uint64_t>& slab_bytes) : free_(slab_bytes.size()) {
    for (size_t slab = 0; slab < slab_bytes.size(); slab++) {
        const uint64_t bytes = slab_bytes[slab] / RP_BLOCK_ALIGNMENT * RP_BLOCK_ALIGNMENT;
        if (bytes) free_[slab][0] = bytes;
        capacity_ += bytes;
    }
    free_bytes_ = capacity_;
}

std::optional<PoolAddress> SlabAllocator::allocate(uint64_t bytes) {
    bytes = round_up(bytes);
    std::optional<PoolAddress> best;
    uint64_t best_size = UINT64_MAX;
    for (uint32_t slab = 0; slab < free_.size(); slab++)
        for (const auto& [offset, size] : free_[slab])
            if (size >= bytes && size < best_size) {
                best = PoolAddress{slab, offset};
                best_size = size;
            }
    if (!best) return best;
    auto& extents = free_[best->slab];
    extents.erase(best->offset);
    if (best_size > bytes) extents[best->offset + bytes] = best_size - bytes;
    free_bytes_ -= bytes;
    return best;
}

bool SlabAllocator::fits(uint64_t bytes) const {
    bytes = round_up(bytes);
    for (const auto& extents : free_)
        for (const auto& [offset, size] : extents)
            if (size >= bytes) return true;
    return false;
}

uint64_t SlabAllocator::release(PoolAddress address, uint64_t bytes) {
    bytes = round_up(bytes);
    auto& extents = free_.at(address.slab);
    auto [at, inserted] = extents.emplace(address.offset, bytes);
    RAYPAGER_CHECK(inserted);
    free_bytes_ += bytes;
    if (auto next = std::next(at); next != extents.end()) {
        RAYPAGER_CHECK(at->first + at->second <= next->first);
        if (at->first + at->second == next->first) {
            at->second += next->second;
            extents.erase(next);
        }
    }
    if (at == extents.begin()) return at->second;
    auto before = std::prev(at);
    RAYPAGER_CHECK(before->first + before->second <= at->first);
    if (before->first + before->second != at->first) return at->second;
    before->second += at->second;
    extents.erase(at);
    return before->second;
}

void SlabAllocator::take_back(PoolAddress address, uint64_t bytes) {
    bytes = round_up(bytes);
    auto& extents = free_.at(address.slab);
    auto at = extents.upper_bound(address.offset);
    RAYPAGER_CHECK(at != extents.begin());
    --at;
    const uint64_t offset = at->first, end = at->first + at->second;
    RAYPAGER_CHECK(address.offset + bytes <= end);
    extents.erase(at);
    if (offset < address.offset) extents[offset] = address.offset - offset;
    if (address.offset + bytes < end) extents[address.offset + bytes] = end - (address.offset + bytes);
    free_bytes_ -= bytes;
}

}  // namespace raypager
