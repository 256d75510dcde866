#include "residency/residency.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <numeric>
#include <utility>

#include "base/check.hpp"
#include "base/words.hpp"
#include "raypager/abi/path.h"

namespace raypager {
namespace {

// More entries of the page table than these are not worth a launch for each few of them: with many blocks, writing them all takes as long as many
// launches.
size_t max_changes(size_t blocks) { return std::max<size_t>(8 * RP_PAGE_CHANGES, blocks / 128); }

uint32_t page_address(PoolAddress place) {
    const uint64_t unit = place.offset / RP_BLOCK_ALIGNMENT;
    RAYPAGER_CHECK(unit <= RP_PAGE_OFFSET_MASK && place.slab < RP_MAX_SLABS);
    return place.slab << RP_PAGE_SLAB_SHIFT | static_cast<uint32_t>(unit);
}

uint64_t whole_slab(uint64_t max_slab_bytes) {
    constexpr uint64_t addressable = (uint64_t{RP_PAGE_OFFSET_MASK} + 1) * RP_BLOCK_ALIGNMENT;
    return std::min(max_slab_bytes, addressable) / RP_BLOCK_ALIGNMENT * RP_BLOCK_ALIGNMENT;
}

}  // namespace

uint64_t pool_for_all(uint64_t all_bytes, uint64_t max_slab_bytes, uint64_t largest_block) {
    const uint64_t slab = whole_slab(max_slab_bytes);
    return all_bytes <= slab ? all_bytes : all_bytes + (all_bytes / slab + 1) * 2 * largest_block;
}

uint64_t largest_pool(uint64_t max_slab_bytes) { return RP_MAX_SLABS * whole_slab(max_slab_bytes); }

Result<std::vector<uint64_t>> split_pool(uint64_t pool_bytes, uint64_t max_slab_bytes, uint64_t largest_block) {
    const uint64_t slab = whole_slab(max_slab_bytes);
    pool_bytes = pool_bytes / RP_BLOCK_ALIGNMENT * RP_BLOCK_ALIGNMENT;
    if (largest_block > slab)
        return Status::failed(fmt::format("the largest block has {}, but the device allocates at most {} at once; bake with a smaller --block-size",
                                          format_bytes(largest_block), format_bytes(slab)));
    std::vector<uint64_t> sizes;
    // A last slab that might not take every block is left out.
    while (pool_bytes >= std::max<uint64_t>(1, largest_block) && sizes.size() < RP_MAX_SLABS) {
        sizes.push_back(std::min(slab, pool_bytes));
        pool_bytes -= sizes.back();
    }
    return sizes;
}

namespace {

Result<std::vector<uint64_t>> slab_sizes(const Device& device, const BakedScene& scene, const ResidencySettings& settings) {
    const uint64_t max_slab = std::min(device.info().max_allocation_bytes, settings.slab_bytes ? settings.slab_bytes : UINT64_MAX);
    return split_pool(settings.pool_bytes, max_slab, scene.largest_pageable(settings.form));
}

}  // namespace

std::shared_ptr<HostCache> Residency::make_cache(Device& device, const BlockSource& source, const ResidencySettings& settings, uint32_t devices) {
    // Where the pool holds everything, each block passes through the cache once; but for several devices it stays until all have had it.
    constexpr uint64_t passage = uint64_t{128} << 20;
    const BakedScene& scene = source.scene();
    const auto slabs = slab_sizes(device, scene, settings);
    const uint64_t pool = slabs ? std::accumulate(slabs->begin(), slabs->end(), uint64_t{0}) : 0;
    const bool once = devices == 1 && scene.memory_bytes(settings.form) <= pool;
    return std::make_shared<HostCache>(device, source, settings.form, once ? std::min(settings.host_limit, passage) : settings.host_limit, once);
}

Result<std::unique_ptr<Residency>> Residency::create(Device& device, std::shared_ptr<HostCache> cache, const ResidencySettings& settings) {
    const BakedScene& scene = cache->scene();
    auto sizes = slab_sizes(device, scene, settings);
    if (!sizes) return sizes.status();
    std::vector<uint32_t> block_bytes;
    for (uint32_t block = 0; block < scene.pageable_count(); block++) block_bytes.push_back(scene.pageable_bytes(block, settings.form));
    std::unique_ptr<Residency> residency(new Residency(BlockTable(block_bytes, SlabAllocator(*sizes), settings.policy, settings.journal)));
    RAYPAGER_TRY(residency->allocate_slabs(device, *sizes, settings.place));
    residency->pages_.assign(std::max<size_t>(scene.pageable_count(), 1), rp_page{RP_NONE, 0, 0, 0});
    auto table = device.allocate(residency->pages_.size() * sizeof(rp_page), "the page table");
    if (!table) return table.status();
    residency->page_table_ = std::move(*table);
    for (Published& copy : residency->published_) {
        auto pages = device.allocate_pinned(residency->page_table_.bytes());
        if (!pages) return pages.status();
        copy.pages = std::move(*pages);
    }
    residency->cache_ = std::move(cache);
    residency->loader_ = Loader::create(device, *residency->cache_, residency->slabs_, settings.loader_threads);
    const size_t ahead = device.thread_safe() ? settings.read_ahead_threads.value_or(device.profile().read_ahead_threads) : 0;
    residency->read_ahead_ = std::make_unique<ReadAhead>(*residency->cache_, ahead, device.profile().pinned_ahead_bytes);
    return residency;
}

// Copies of the page table may be on their way from memory of ours.
Residency::~Residency() {
    for (const Published& copy : published_) (void)copy.written.wait();
}

Status Residency::allocate_slabs(Device& device, const std::vector<uint64_t>& sizes, PoolPlace place) {
    for (size_t i = 0; i < sizes.size(); i++) {
        const std::string what = fmt::format("slab {} of the geometry pool", i);
        auto slab = place == PoolPlace::host ? device.allocate_mapped(sizes[i], what) : device.allocate(sizes[i], what);
        if (!slab) return slab.status();
        slabs_.push_back(std::move(*slab));
        if (place == PoolPlace::host) mapped_bytes_ += sizes[i];
    }
    if (!slabs_.empty()) return {};
    auto slab = device.allocate(RP_BLOCK_ALIGNMENT, "an empty geometry pool");  // an empty scene: kernels still need a buffer to point at
    if (!slab) return slab.status();
    slabs_.push_back(std::move(*slab));
    return {};
}

Status Residency::publish(Queue& queue) {
    std::sort(changed_.begin(), changed_.end());
    changed_.erase(std::unique(changed_.begin(), changed_.end()), changed_.end());
    if (nothing_published_ || changed_.size() > max_changes(pages_.size())) return publish_all(queue);
    take_newly_published();
    list_changes();
    return {};
}

// Once each; what has left again meanwhile has not been seen by any round.
void Residency::take_newly_published() {
    newly_published_ = std::exchange(came_, {});
    std::sort(newly_published_.begin(), newly_published_.end());
    newly_published_.erase(std::unique(newly_published_.begin(), newly_published_.end()), newly_published_.end());
    std::erase_if(newly_published_, [this](uint32_t block) { return pages_[block].address == RP_NONE; });
}

Status Residency::publish_all(Queue& queue) {
    take_newly_published();
    changed_.clear();
    page_changes_.clear();
    nothing_published_ = false;
    Published& copy = published_[next_published_++ % published_.size()];
    RAYPAGER_TRY(copy.written.wait());
    std::memcpy(copy.pages.bytes().data(), pages_.data(), page_table_.bytes());
    return queue.write(page_table_, 0, copy.pages.bytes().first(page_table_.bytes()), &copy.written);
}

// For kernels, as their arguments. A write of more than some KB takes the way that uploads take, and would keep the next round waiting until all that
// have been given before it are done: 0.4 ms for each 24 blocks of 640 KB on an H100.
void Residency::list_changes() {
    page_changes_.clear();
    for (const uint32_t block : changed_) {
        page_changes_.push_back(pages_[block]);
        page_changes_.back().block = block;
    }
    changed_.clear();
}

Status Residency::take_arrivals(uint32_t round, bool wait) {
    auto arrived = loader_->arrived(wait);
    if (!arrived) return arrived.status();
    for (const Arrival& arrival : *arrived) {
        table_.arrive(round, arrival.block);
        pages_[arrival.block] = {page_address(blocks()[arrival.block].address), arrival.leaves_at, arrival.vertices_at, 0};
        changed_.push_back(arrival.block);
        came_.push_back(arrival.block);
    }
    if (!arrived->empty()) last_arrival_round_ = round;
    return {};
}

Status Residency::after_round(uint32_t round, uint32_t last_started, const Event& last_end, uint32_t ready_rays, uint32_t slots) {
    RAYPAGER_TRY(take_arrivals(last_started, false));
    const Plan plan = table_.plan(round, ready_rays, slots);
    for (const uint32_t block : plan.evict) pages_[block] = {RP_NONE, 0, 0, 0};
    changed_.insert(changed_.end(), plan.evict.begin(), plan.evict.end());
    // Places that were free before were freed by an earlier plan, so uploads into them wait only for rounds that had been started by then. These have
    // usually ended; an upload that has nothing to wait for begins sooner.
    auto ended = last_plan_end_.finished();
    if (!ended) return ended.status();
    loader_->start(plan.load, last_end, *ended ? Event() : last_plan_end_);
    last_plan_end_ = last_end;
    std::vector<uint32_t> ahead = loader_->to_begin();
    ahead.insert(ahead.end(), plan.behind.begin(), plan.behind.end());
    read_ahead_->request(std::move(ahead));
    return {};
}

Result<bool> Residency::wait_for_block(uint32_t round) {
    if (last_arrival_round_ != round) RAYPAGER_TRY(take_arrivals(round, true));
    return last_arrival_round_ == round;
}

Status Residency::load_all(Queue& queue) {
    for (uint32_t round = 1;; round++) {
        std::vector<rp_block_demand> demand;
        uint32_t absent = 0;
        for (uint32_t i = 0; i < blocks().size(); i++) {
            const uint32_t requests = blocks()[i].state == PageState::resident ? 0 : 1;
            if (requests != blocks()[i].requests) demand.push_back({i, requests, 0, 0});
            absent += requests;
        }
        take_demand(round, demand);
        if (absent == 0) return publish_all(queue);
        RAYPAGER_TRY(after_round(round, round, Event(), 0, 1));
        if (statistics().evictions) return Status::failed("the pool is too small for all blocks at once");
        auto arrived = wait_for_block(round);
        if (!arrived) return arrived.status();
        if (!*arrived) return Status::failed("a block never came; this is a bug");
    }
}

}  // namespace raypager
