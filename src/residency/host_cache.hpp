// Blocks and pages of images in host memory, as the device has them, up to a limit, in front of their source. They lie in pinned memory, so that
// uploads go straight out of the cache. The least recently used goes out. Thread-safe.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

#include "device/device.hpp"
#include "raypager/status.hpp"
#include "residency/slab_allocator.hpp"
#include "store/block_source.hpp"

namespace raypager {

// Numbers of blocks are those of the page table: pages come behind the blocks (BakedScene::is_page).
class HostCache {
public:
    // A limit below the two largest blocks is raised to that. once: each block is acquired once, and need not stay when it has been released.
    HostCache(Device& device, const BlockSource& source, BlockForm form, uint64_t limit_bytes, bool once = false);
    BlockForm form() const { return form_; }
    const BakedScene& scene() const { return source_.scene(); }
    // The bytes of a block in that form: from the cache, or read from the source, verified and transcoded. They stay where they are
    // until release(). Waits while memory is being pinned, or everything that is cached is held by others (REQUIRES: those come to release
    // without this call). given_up: whoever asks may change their mind while they wait, and then wake() those that do.
    Result<std::span<const std::byte>> acquire(uint32_t block, const std::atomic<bool>* given_up = nullptr);
    void wake();
    // The same without waiting or reading; nothing if the block is not there.
    std::optional<std::span<const std::byte>> acquire_if_there(uint32_t block);
    void release(uint32_t block);
    // Whether a block is there or being read.
    bool knows(uint32_t block) const;
    // Reads a block that may be acquired later, if it is not there and there is room for it without another that goes. If it cannot be read, nothing
    // is there, and acquire() will say why. False: there is no room for any, or the cache was closed.
    bool read_ahead(uint32_t block);
    // Gets some of the memory for so many bytes of blocks, as far as all of them and the limit need it, before it is asked for. False: that was all.
    bool prepare(uint64_t bytes);
    // Of who acquires blocks and releases them. When the last one leaves, the cache is closed.
    void enter();
    void leave();
    // Ends all waiting: calls of acquire() that have to wait fail from now on.
    void close();
    uint64_t peak_bytes() const;

private:
    struct Place {
        size_t chunk;
        uint64_t offset;
    };
    struct Entry {
        Place place;
        uint64_t bytes = 0;  // reserved
        uint32_t holders = 0;
        bool ready = false;  // false: being read
        std::list<uint32_t>::iterator age;
    };
    struct Chunk {
        PinnedBuffer pinned;
        std::unique_ptr<std::byte, decltype(&std::free)> plain{nullptr,
                                                               &std::free};  // where the device that pins memory has been lost, and others go on
        std::span<std::byte> bytes;
        SlabAllocator free;
    };
    using Lock = std::unique_lock<std::mutex>;
    // evicts: others may go for it; otherwise fails where they would have to. May let go of the lock.
    Result<Place> make_room(Lock& lock, uint64_t bytes, bool evicts, const std::atomic<bool>* given_up = nullptr);
    // Reads a block into its place, without the lock, and holds it; or gives the place back. REQUIRES: the block has no entry.
    Status fill(Lock& lock, uint32_t block, const Place& place);
    void give_back(const Place& place, uint64_t bytes);
    void drop(uint32_t block);
    bool evict_oldest();
    Status add_chunk(Lock& lock);
    Status read(uint32_t block, std::span<std::byte> target) const;
    uint64_t room_for(uint32_t block) const;
    std::span<const std::byte> hold(uint32_t block, Entry& entry);
    std::span<std::byte> bytes_at(const Place& place, uint64_t bytes) { return chunks_[place.chunk].bytes.subspan(place.offset, bytes); }

    Device& device_;
    const BlockSource& source_;
    const BlockForm form_;
    const bool once_;
    uint64_t limit_, chunk_bytes_, all_bytes_ = 0;
    mutable std::mutex mutex_;
    std::condition_variable changed_;  // something was released or became ready, or a chunk has come or not
    std::vector<Chunk> chunks_;
    std::unordered_map<uint32_t, Entry> entries_;
    std::list<uint32_t> by_age_;  // least recently used first
    uint64_t allocated_ = 0;      // with chunks that are being added
    int adding_ = 0;              // chunks that are being pinned, without the lock
    bool closed_ = false;
    uint32_t users_ = 0;
    bool shared_ = false;  // there were several of them
};

}  // namespace raypager
