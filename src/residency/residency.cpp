#include "residency/residency.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>

#include "base/check.hpp"
#include "raypager/abi/path.h"

namespace raypager {
namespace {

uint32_t page_address(PoolAddress place) {
    const uint64_t unit = place.offset / RP_BLOCK_ALIGNMENT;
    RAYPAGER_CHECK(unit <= RP_PAGE_OFFSET_MASK && place.slab < RP_MAX_SLABS);
    return place.slab << RP_PAGE_SLAB_SHIFT | static_cast<uint32_t>(unit);
}

}  // namespace

Result<std::vector<uint64_t>> split_pool(uint64_t pool_bytes, uint64_t max_slab_bytes, uint64_t largest_block) {
    constexpr uint64_t addressable = (uint64_t{RP_PAGE_OFFSET_MASK} + 1) * RP_BLOCK_ALIGNMENT;
    const uint64_t slab = std::min(max_slab_bytes, addressable) / RP_BLOCK_ALIGNMENT * RP_BLOCK_ALIGNMENT;
    pool_bytes = pool_bytes / RP_BLOCK_ALIGNMENT * RP_BLOCK_ALIGNMENT;
    if (largest_block > slab)
        return Status::failed(fmt::format(
            "the largest block has {} bytes, but the device allocates at most {} at once; bake with a smaller --block-size", largest_block, slab));
    std::vector<uint64_t> sizes;
    // A last slab that might not take every block is left out.
    while (pool_bytes >= std::max<uint64_t>(1, largest_block) && sizes.size() < RP_MAX_SLABS) {
        sizes.push_back(std::min(slab, pool_bytes));
        pool_bytes -= sizes.back();
    }
    return sizes;
}

Result<std::unique_ptr<Residency>> Residency::create(Device& device, const BlockFile& file, const ResidencySettings& settings) {
    const BakedScene& scene = file.scene();
    const uint64_t max_slab = std::min(device.info().max_allocation_bytes, settings.slab_bytes ? settings.slab_bytes : UINT64_MAX);
    auto sizes = split_pool(settings.pool_bytes, max_slab, scene.largest_block());
    if (!sizes) return sizes.status();
    std::unique_ptr<Residency> residency(new Residency(SlabAllocator(*sizes)));
    residency->policy_ = settings.policy;
    // No more blocks can be on their way than fit into the pool.
    uint64_t smallest = UINT64_MAX;
    for (const BlockRecord& block : scene.blocks) smallest = std::min<uint64_t>(smallest, block.memory_bytes);
    const auto most = static_cast<uint32_t>(std::clamp<uint64_t>(settings.pool_bytes / smallest, 1, UINT32_MAX));
    residency->policy_.loads_in_flight = std::min(settings.policy.loads_in_flight, most);
    residency->policy_.loads_into_free = std::min(settings.policy.loads_into_free, most);
    for (size_t i = 0; i < sizes->size(); i++) {
        auto slab = device.allocate((*sizes)[i], fmt::format("slab {} of the geometry pool", i));
        if (!slab) return slab.status();
        residency->slabs_.push_back(std::move(*slab));
    }
    if (residency->slabs_.empty()) {  // an empty scene: kernels still need a buffer to point at
        auto slab = device.allocate(RP_BLOCK_ALIGNMENT, "an empty geometry pool");
        if (!slab) return slab.status();
        residency->slabs_.push_back(std::move(*slab));
    }
    residency->blocks_.resize(scene.blocks.size());
    for (size_t i = 0; i < scene.blocks.size(); i++) residency->blocks_[i].bytes = scene.blocks[i].memory_bytes;
    residency->pages_.assign(std::max<size_t>(scene.blocks.size(), 1), rp_page{RP_NONE, 0, 0, 0});
    auto table = device.allocate(residency->pages_.size() * sizeof(rp_page), "the page table");
    if (!table) return table.status();
    residency->page_table_ = std::move(*table);
    for (Published& copy : residency->published_) {
        auto pages = device.allocate_pinned(residency->page_table_.bytes());
        if (!pages) return pages.status();
        copy.pages = std::move(*pages);
    }
    // Where the pool holds everything, each block passes through the cache once.
    constexpr uint64_t passage = uint64_t{128} << 20;
    const bool all_fits = scene.geometry_bytes() <= residency->allocator_.capacity();
    residency->cache_ = std::make_unique<HostCache>(device, file, all_fits ? std::min(settings.host_limit, passage) : settings.host_limit);
    residency->loader_ = Loader::create(device, *residency->cache_, residency->slabs_, settings.loader_threads);
    return residency;
}

Status Residency::publish(Queue& queue) {
    if (!pages_changed_) return {};
    pages_changed_ = false;
    Published& copy = published_[next_published_++ % published_.size()];
    RAYPAGER_TRY(copy.written.wait());
    std::memcpy(copy.pages.bytes().data(), pages_.data(), page_table_.bytes());
    return queue.write(page_table_, 0, copy.pages.bytes().first(page_table_.bytes()), &copy.written);
}

Status Residency::take_arrivals(uint32_t round, bool wait) {
    auto arrived = loader_->arrived(wait);
    if (!arrived) return arrived.status();
    for (const Arrival& arrival : *arrived) {
        BlockState& block = blocks_[arrival.block];
        RAYPAGER_CHECK(block.state == PageState::loading);
        block.state = PageState::resident;
        block.resident_since = round + 1;
        block.last_used = round + 1;
        pages_[arrival.block] = {page_address(block.address), round + 1, arrival.leaves_at, arrival.vertices_at};
        pages_changed_ = true;
        statistics_.loads++;
        statistics_.bytes_loaded += block.bytes;
    }
    if (!arrived->empty()) last_arrival_round_ = round;
    return {};
}

void Residency::evict(uint32_t index) {
    BlockState& block = blocks_[index];
    RAYPAGER_CHECK(block.state == PageState::resident);
    resident_bytes_ -= block.bytes;
    block.state = PageState::absent;
    block.wanted_since = 0;
    pages_[index] = {RP_NONE, 0, 0, 0};
    pages_changed_ = true;
    statistics_.evictions++;
}

Status Residency::after_round(uint32_t round, uint32_t last_started, const Event& last_end, std::span<const uint32_t> demand, uint32_t ready_rays,
                              uint32_t slots) {
    const size_t count = blocks_.size();
    RAYPAGER_CHECK(demand.size() >= RP_DEMAND_ARRAYS * count);
    for (size_t i = 0; i < count; i++) {
        BlockState& block = blocks_[i];
        block.wants = demand[RP_DEMAND_WANTS * count + i];
        block.bounces = demand[RP_DEMAND_BOUNCES * count + i];
        block.last_used = std::max(block.last_used, demand[RP_DEMAND_USED * count + i]);
        if (block.wants == 0)
            block.wanted_since = 0;
        else if (block.wanted_since == 0)
            block.wanted_since = round;
    }
    RAYPAGER_TRY(take_arrivals(last_started, false));
    const Plan plan = plan_paging(policy_, {blocks_, round, ready_rays, slots}, allocator_);
    allocator_ = plan.pool;
    for (const uint32_t block : plan.evict) evict(block);
    for (const PlannedLoad& load : plan.load) {
        BlockState& block = blocks_[load.block];
        RAYPAGER_CHECK(block.state == PageState::absent);
        block.state = PageState::loading;
        block.address = load.address;
        resident_bytes_ += block.bytes;
        RAYPAGER_CHECK(resident_bytes_ <= allocator_.capacity());
        statistics_.peak_resident_bytes = std::max(statistics_.peak_resident_bytes, resident_bytes_);
        loader_->start(load.block, load.address, last_end);
    }
    return {};
}

Result<bool> Residency::wait_for_block(uint32_t round) {
    if (last_arrival_round_ != round) RAYPAGER_TRY(take_arrivals(round, true));
    return last_arrival_round_ == round;
}

Status Residency::load_all(Queue& queue) {
    const size_t count = blocks_.size();
    std::vector<uint32_t> demand(count * RP_DEMAND_ARRAYS);
    for (uint32_t round = 1;; round++) {
        size_t absent = 0;
        for (size_t i = 0; i < count; i++) {
            demand[RP_DEMAND_WANTS * count + i] = blocks_[i].state == PageState::resident ? 0 : 1;
            absent += demand[RP_DEMAND_WANTS * count + i];
        }
        if (absent == 0) return publish(queue);
        RAYPAGER_TRY(after_round(round, round, Event(), demand, 0, 1));
        if (statistics_.evictions) return Status::failed("the pool is too small for all blocks at once");
        auto arrived = wait_for_block(round);
        if (!arrived) return arrived.status();
        if (!*arrived) return Status::failed("a block never came; this is a bug");
    }
}

}  // namespace raypager
