// The pool: which blocks and pages of images are where on the device, what comes in and goes out. Sits between the rounds of the tracer. To all that
// pages, a page of images is a block with a number behind those of the blocks (BakedScene::is_page).
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "device/device.hpp"
#include "raypager/abi/block.h"
#include "residency/block_table.hpp"
#include "residency/host_cache.hpp"
#include "residency/loader.hpp"
#include "residency/policy.hpp"
#include "residency/read_ahead.hpp"

namespace raypager {

struct ResidencySettings {
    BlockForm form = BlockForm::stored;          // of the blocks on the device
    uint64_t pool_bytes = 0;                     // at most; REQUIRES: at least the largest of them
    uint64_t slab_bytes = 0;                     // of one slab at most; 0: what the device allocates at once
    uint64_t host_limit = 0;                     // of the cache of blocks
    uint32_t loader_threads = 0;                 // 0: as the device's profile says
    std::optional<uint32_t> read_ahead_threads;  // none: as the device's profile says
    PolicySettings policy;
    PoolPlace place = PoolPlace::device;
    bool journal = false;  // remember when which block came and went
};

// Sizes of the slabs for a pool: as few as possible, each large enough for the largest block; what is left over is not used.
Result<std::vector<uint64_t>> split_pool(uint64_t pool_bytes, uint64_t max_slab_bytes, uint64_t largest_block);
// Bytes of a pool that holds all blocks, ends of slabs included that no block fits into; and of the largest pool that there can be.
uint64_t pool_for_all(uint64_t all_bytes, uint64_t max_slab_bytes, uint64_t largest_block);
uint64_t largest_pool(uint64_t max_slab_bytes);

class Residency {
public:
    static Result<std::unique_ptr<Residency>> create(Device& device, const BlockSource& source, const ResidencySettings& settings) {
        return create(device, make_cache(device, source, settings, 1), settings);
    }
    // The same with a cache of blocks that several devices share.
    static Result<std::unique_ptr<Residency>> create(Device& device, std::shared_ptr<HostCache> cache, const ResidencySettings& settings);
    // In memory that this device has pinned, which outlives it.
    static std::shared_ptr<HostCache> make_cache(Device& device, const BlockSource& source, const ResidencySettings& settings, uint32_t devices);
    ~Residency();

    const std::shared_ptr<HostCache>& cache() const { return cache_; }
    const std::vector<Buffer>& slabs() const { return slabs_; }
    const Buffer& page_table() const { return page_table_; }
    // Brings the page table on the device up to date, for the rounds that follow: by a write of all of it, for which the queue is not waited, or by
    // page_changes(), which is then for kernels to do before the next round. REQUIRES: those of the call before are on the device.
    Status publish(Queue& queue);
    std::span<const rp_page> page_changes() const { return page_changes_; }
    // Blocks that the last publish() made visible: all that came since the one before it and are still there, each once.
    std::span<const uint32_t> newly_published() const { return newly_published_; }
    // What a round tells of blocks when it has ended (BlockTable::take_demand). REQUIRES: each round's is taken in, in their order.
    void take_demand(uint32_t round, std::span<const rp_block_demand> demand) { table_.take_demand(round, demand); }
    // After that: takes in what has arrived, evicts, and starts loads.
    // last_started: the youngest round under way (or `round`), and when it will have ended: until then kernels may read what is evicted now.
    Status after_round(uint32_t round, uint32_t last_started, const Event& last_end, uint32_t ready_rays, uint32_t slots);
    // When no ray can go on and no round is under way: waits until a block has arrived since that round ended. False if none has, and none
    // is on its way.
    Result<bool> wait_for_block(uint32_t round);
    // Without a round that ends: takes in what has arrived, so that nothing is held in the cache that others need room in. round: the youngest that
    // was started.
    Status take_arrivals_between(uint32_t round) { return take_arrivals(round, false); }
    // The rays that waited are gone, and counters of use begin anew at 0. Blocks stay.
    void forget_demand() { table_.forget_demand(); }
    // For measurements and tests, instead of rounds: brings in every block and publishes the page table. Fails if they do not fit.
    Status load_all(Queue& queue);

    const PagingStatistics& statistics() const { return table_.statistics(); }
    const std::vector<PagingEvent>& journal() const { return table_.journal(); }
    const PolicySettings& policy() const { return table_.policy(); }
    uint64_t resident_bytes() const { return table_.resident_bytes(); }
    uint64_t pool_bytes() const { return table_.pool_bytes(); }
    // Cached blocks, and the pool if it lies in host memory.
    uint64_t host_peak_bytes() const { return cache_->peak_bytes() + mapped_bytes_; }
    // For people; from any thread.
    std::string loader_activity() const { return loader_->activity(); }
    std::span<const BlockState> blocks() const { return table_.blocks(); }
    const ActiveBlocks& active() const { return table_.active(); }

private:
    explicit Residency(BlockTable table) : table_(std::move(table)) {}
    Status allocate_slabs(Device& device, const std::vector<uint64_t>& sizes, PoolPlace place);
    Status publish_all(Queue& queue);
    void take_newly_published();
    void list_changes();
    Status take_arrivals(uint32_t round, bool wait);

    BlockTable table_;
    std::shared_ptr<HostCache> cache_;
    std::vector<Buffer> slabs_;
    Buffer page_table_;
    std::vector<rp_page> pages_;         // what the device shall see
    std::vector<uint32_t> changed_;      // entries that the device does not have yet
    std::vector<rp_page> page_changes_;  // as rp_page_changes has them
    bool nothing_published_ = true;
    std::vector<uint32_t> came_, newly_published_;
    // Copies of the whole table on their way to the device.
    struct Published {
        PinnedBuffer pages;
        Event written;
    };
    std::array<Published, 2> published_;
    size_t next_published_ = 0;
    // After slabs_ and cache_: destroyed first.
    std::unique_ptr<Loader> loader_;
    std::unique_ptr<ReadAhead> read_ahead_;
    uint64_t mapped_bytes_ = 0;
    uint32_t last_arrival_round_ = 0;
    Event last_plan_end_;  // when the rounds that had been started at the last plan have ended
};

}  // namespace raypager
