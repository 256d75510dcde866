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
        if (bytes) add(static_cast<uint32_t>(slab), 0, bytes);
        capacity_ += bytes;
    }
    free_bytes_ = capacity_;
}

void SlabAllocator::add(uint32_t slab, uint64_t offset, uint64_t bytes) {
    free_[slab][offset] = bytes;
    by_size_.emplace(bytes, slab, offset);
}

void SlabAllocator::remove(uint32_t slab, Extents::iterator extent) {
    by_size_.erase({extent->second, slab, extent->first});
    free_[slab].erase(extent);
}

std::optional<PoolAddress> SlabAllocator::allocate(uint64_t bytes) {
    bytes = round_up(bytes);
    const auto best = by_size_.lower_bound({bytes, 0, 0});
    if (best == by_size_.end()) return {};
    const auto [size, slab, offset] = *best;
    remove(slab, free_[slab].find(offset));
    if (size > bytes) add(slab, offset + bytes, size - bytes);
    free_bytes_ -= bytes;
    return PoolAddress{slab, offset};
}

bool SlabAllocator::fits(uint64_t bytes) const { return by_size_.lower_bound({round_up(bytes), 0, 0}) != by_size_.end(); }

uint64_t SlabAllocator::release(PoolAddress address, uint64_t bytes) {
    bytes = round_up(bytes);
    Extents& extents = free_.at(address.slab);
    free_bytes_ += bytes;
    uint64_t begin = address.offset, end = address.offset + bytes;
    const auto next = extents.lower_bound(begin);
    RAYPAGER_CHECK(next == extents.end() || end <= next->first);
    if (next != extents.begin()) {
        const auto before = std::prev(next);
        RAYPAGER_CHECK(before->first + before->second <= begin);
        if (before->first + before->second == begin) {
            begin = before->first;
            remove(address.slab, before);
        }
    }
    if (next != extents.end() && next->first == end) {
        end += next->second;
        remove(address.slab, next);
    }
    add(address.slab, begin, end - begin);
    return end - begin;
}

void SlabAllocator::take_back(PoolAddress address, uint64_t bytes) {
    bytes = round_up(bytes);
    Extents& extents = free_.at(address.slab);
    auto at = extents.upper_bound(address.offset);
    RAYPAGER_CHECK(at != extents.begin());
    --at;
    const uint64_t offset = at->first, end = at->first + at->second;
    RAYPAGER_CHECK(address.offset + bytes <= end);
    remove(address.slab, at);
    if (offset < address.offset) add(address.slab, offset, address.offset - offset);
    if (address.offset + bytes < end) add(address.slab, address.offset + bytes, end - (address.offset + bytes));
    free_bytes_ -= bytes;
}

}  // namespace raypager
