#include "residency/host_cache.hpp"

#include <algorithm>
#include <new>

#include "base/check.hpp"
#include "residency/transcode.hpp"

namespace raypager {
namespace {

// Pinned memory is had in pieces as it is needed: a driver launches nothing while it pins. So the pieces are small, but not so small that
// much is lost at their ends, where no block fits.
constexpr uint64_t blocks_a_chunk = 32, min_chunk_bytes = uint64_t{4} << 20, max_chunk_bytes = uint64_t{64} << 20;
// Memory of one is touched for the first time while a driver pins another.
constexpr int chunks_at_once = 2;

}  // namespace

HostCache::HostCache(Device& device, const BlockSource& source, BlockForm form, uint64_t limit_bytes, bool once)
    : device_(device), source_(source), form_(form), once_(once) {
    uint64_t largest = RP_BLOCK_ALIGNMENT;
    for (uint32_t block = 0; block < scene().pageable_count(); block++) {
        largest = std::max(largest, room_for(block));
        all_bytes_ += room_for(block);
    }
    limit_ = std::max(limit_bytes, 2 * largest);
    const uint64_t usual = std::clamp(blocks_a_chunk * largest, min_chunk_bytes, max_chunk_bytes);
    chunk_bytes_ = std::clamp(std::min(all_bytes_, limit_ / 8), largest, std::max(largest, usual));
    chunk_bytes_ = chunk_bytes_ / RP_BLOCK_ALIGNMENT * RP_BLOCK_ALIGNMENT;
}

// For a block while it is read and transcoded in place.
uint64_t HostCache::room_for(uint32_t block) const {
    const uint64_t bytes = std::max(scene().pageable_bytes(block, BlockForm::stored), scene().pageable_bytes(block, form_));
    return (bytes + RP_BLOCK_ALIGNMENT - 1) / RP_BLOCK_ALIGNMENT * RP_BLOCK_ALIGNMENT;
}

Result<std::span<const std::byte>> HostCache::acquire(uint32_t block, const std::atomic<bool>* given_up) {
    Lock lock(mutex_);
    for (;;) {
        const auto found = entries_.find(block);
        if (found == entries_.end()) break;
        if (found->second.ready) return hold(block, found->second);
        if (closed_ || (given_up && *given_up)) return Status::failed("the cache of blocks was closed");
        changed_.wait(lock);
    }
    const auto place = make_room(lock, room_for(block), true, given_up);
    if (!place) return place.status();
    if (entries_.count(block)) {  // another thread was faster while this one waited for room
        give_back(*place, room_for(block));
        lock.unlock();
        return acquire(block, given_up);
    }
    RAYPAGER_TRY(fill(lock, block, *place));
    return std::span<const std::byte>(bytes_at(*place, scene().pageable_bytes(block, form_)));
}

bool HostCache::read_ahead(uint32_t block) {
    Lock lock(mutex_);
    if (closed_ || entries_.count(block)) return !closed_;
    const uint64_t room = room_for(block);
    const auto place = make_room(lock, room, false);
    if (!place) return false;
    if (entries_.count(block)) {
        give_back(*place, room);
    } else if (fill(lock, block, *place).ok()) {
        entries_.at(block).holders--;
        changed_.notify_all();
    }
    return true;
}

bool HostCache::knows(uint32_t block) const {
    const Lock lock(mutex_);
    return entries_.count(block) != 0;
}

Status HostCache::fill(Lock& lock, uint32_t block, const Place& place) {
    const uint64_t room = room_for(block);
    const std::span<std::byte> target = bytes_at(place, room);
    try {
        std::list<uint32_t> age = {block};
        entries_[block] = Entry{place, room, 1, false, age.begin()};
        by_age_.splice(by_age_.end(), age);  // does not throw, so that a block is in both or neither
    } catch (...) {
        give_back(place, room);
        throw;
    }
    lock.unlock();
    Status status;
    try {
        status = read(block, target);
    } catch (const std::bad_alloc&) {
        status = Status::failed("not enough host memory to read a block; give a smaller --host-limit");
    }
    lock.lock();
    if (status.ok())
        entries_.at(block).ready = true;
    else
        drop(block);
    changed_.notify_all();
    return status;
}

void HostCache::give_back(const Place& place, uint64_t bytes) {
    chunks_[place.chunk].free.release({0, place.offset}, bytes);
    changed_.notify_all();
}

void HostCache::drop(uint32_t block) {
    const auto entry = entries_.find(block);
    give_back(entry->second.place, entry->second.bytes);
    by_age_.erase(entry->second.age);
    entries_.erase(entry);
}

std::optional<std::span<const std::byte>> HostCache::acquire_if_there(uint32_t block) {
    const Lock lock(mutex_);
    const auto found = entries_.find(block);
    if (found == entries_.end() || !found->second.ready) return std::nullopt;
    return hold(block, found->second);
}

std::span<const std::byte> HostCache::hold(uint32_t block, Entry& entry) {
    entry.holders++;
    by_age_.splice(by_age_.end(), by_age_, entry.age);
    return bytes_at(entry.place, scene().pageable_bytes(block, form_));
}

void HostCache::release(uint32_t block) {
    const Lock lock(mutex_);
    const auto entry = entries_.find(block);
    RAYPAGER_CHECK(entry != entries_.end() && entry->second.holders > 0);
    entry->second.holders--;
    if (once_ && entry->second.holders == 0) drop(block);
    changed_.notify_all();
}

bool HostCache::prepare(uint64_t bytes) {
    Lock lock(mutex_);
    changed_.wait(lock, [&] { return closed_ || adding_ < chunks_at_once; });
    return !closed_ && allocated_ < std::min(bytes, all_bytes_) && allocated_ + chunk_bytes_ <= limit_ && add_chunk(lock).ok();
}

void HostCache::enter() {
    const Lock lock(mutex_);
    shared_ = ++users_ > 1 || shared_;
}

void HostCache::leave() {
    const Lock lock(mutex_);
    RAYPAGER_CHECK(users_ > 0);
    if (--users_ > 0) return;
    closed_ = true;
    changed_.notify_all();
}

void HostCache::wake() {
    const Lock lock(mutex_);
    changed_.notify_all();
}

void HostCache::close() {
    const Lock lock(mutex_);
    closed_ = true;
    changed_.notify_all();
}

uint64_t HostCache::peak_bytes() const {
    const Lock lock(mutex_);
    return chunks_.size() * chunk_bytes_;  // they are kept
}

Status HostCache::read(uint32_t block, std::span<std::byte> target) const {
    if (scene().is_page(block)) return source_.read_page(block - static_cast<uint32_t>(scene().blocks.size()), target.first(RP_TEXTURE_PAGE_BYTES));
    const std::span<std::byte> stored = target.first(scene().blocks[block].stored_bytes);
    RAYPAGER_TRY(source_.read_block(block, stored));
    RAYPAGER_TRY(source_.check_block(block, stored));
    return transcode_block(scene(), block, form_, target);
}

// A free place: in a chunk that is there, in a new one, or where the oldest blocks were.
Result<HostCache::Place> HostCache::make_room(Lock& lock, uint64_t bytes, bool evicts, const std::atomic<bool>* given_up) {
    for (;;) {
        for (size_t i = 0; i < chunks_.size(); i++) {
            if (chunks_[i].free.free_bytes() < bytes) continue;
            if (const auto place = chunks_[i].free.allocate(bytes)) return Place{i, place->offset};
        }
        const bool may_grow = allocated_ == 0 || allocated_ + chunk_bytes_ <= limit_;
        // More than all blocks take is needed only where they leave gaps.
        if (may_grow && adding_ < (allocated_ < all_bytes_ ? chunks_at_once : 1)) {
            const Status added = add_chunk(lock);
            if (!added.ok() && adding_ > 0) {
                changed_.wait(lock);  // what becomes of the other says whether there is any
            } else if (!added.ok()) {
                if (allocated_ == 0) return added;
                limit_ = allocated_;  // without more pinned memory the cache makes do with what it has
            }
        } else if (adding_ == 0 && !evicts) {
            return Status::failed("the cache of blocks is full");
        } else if (adding_ > 0 || !evict_oldest()) {
            if (closed_ || (given_up && *given_up)) return Status::failed("the cache of blocks was closed");
            changed_.wait(lock);
        }
    }
}

bool HostCache::evict_oldest() {
    const auto oldest = std::find_if(by_age_.begin(), by_age_.end(), [&](uint32_t block) {
        const Entry& entry = entries_.at(block);
        return entry.ready && entry.holders == 0;
    });
    if (oldest == by_age_.end()) return false;
    drop(*oldest);
    return true;
}

// Not under the lock, which release() needs: drivers take their time.
Status HostCache::add_chunk(Lock& lock) {
    struct Adding {
        HostCache& cache;
        Lock& lock;
        Adding(HostCache& c, Lock& l) : cache(c), lock(l) {
            cache.adding_++;
            cache.allocated_ += cache.chunk_bytes_;
            lock.unlock();
        }
        ~Adding() {
            lock.lock();
            cache.adding_--;
            cache.allocated_ -= cache.chunk_bytes_;
            cache.changed_.notify_all();
        }
    };
    auto memory = [&] {
        const Adding adding(*this, lock);
        return device_.allocate_pinned(chunk_bytes_);
    }();
    Chunk chunk = {{}, {nullptr, &std::free}, {}, SlabAllocator({chunk_bytes_})};
    if (memory) {
        chunk.pinned = std::move(*memory);
        chunk.bytes = chunk.pinned.bytes();
    } else if (shared_) {
        chunk.plain.reset(static_cast<std::byte*>(std::aligned_alloc(RP_BLOCK_ALIGNMENT, chunk_bytes_)));
        if (!chunk.plain) return memory.status();
        chunk.bytes = {chunk.plain.get(), chunk_bytes_};
    } else {
        return memory.status();
    }
    chunks_.push_back(std::move(chunk));
    allocated_ += chunk_bytes_;
    return {};
}

}  // namespace raypager
