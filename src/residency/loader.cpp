#include "residency/loader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <new>
#include <utility>

namespace raypager {
namespace {

// Loads that are submitted together: one event tells of all.
constexpr size_t max_together = 8;

}  // namespace

std::unique_ptr<Loader> Loader::create(Device& device, HostCache& cache, const std::vector<Buffer>& slabs, uint32_t threads) {
    std::unique_ptr<Loader> loader(new Loader(device, cache, slabs));
    if (device.thread_safe())
        for (uint32_t i = 0; i < (threads ? threads : device.profile().loader_threads); i++)
            loader->threads_.emplace_back([raw = loader.get()] { raw->work(); });
    return loader;
}

Loader::~Loader() {
    {
        const std::lock_guard lock(mutex_);
        stop_ = true;
    }
    changed_.notify_all();
    given_up_ = true;
    cache_.wake();
    cache_.leave();
    for (std::thread& thread : threads_) thread.join();
    (void)device_.uploads().finish();  // they read the cache's memory
    for (const Load& load : submitted_) cache_.release(load.block);
}

void Loader::start(std::span<const PlannedLoad> loads, const Event& free, const Event& free_before) {
    if (loads.empty()) return;
    {
        const std::lock_guard lock(mutex_);
        for (const PlannedLoad& load : loads)
            waiting_.push_back({load.block, load.address, load.was_free ? free_before : free, {}, {load.block, 0, 0}, {}});
    }
    changed_.notify_all();
}

uint32_t Loader::under_way() const {
    const std::lock_guard lock(mutex_);
    return static_cast<uint32_t>(waiting_.size() + submitted_.size() + reading_.size());
}

std::vector<uint32_t> Loader::to_begin() const {
    const std::lock_guard lock(mutex_);
    std::vector<uint32_t> blocks;
    blocks.reserve(waiting_.size());
    for (const Load& load : waiting_) blocks.push_back(load.block);
    return blocks;
}

std::string Loader::activity() const {
    const std::lock_guard lock(mutex_);
    std::string text = fmt::format("{} loads to begin, {} uploads under way", waiting_.size(), submitted_.size());
    for (const auto& [block, since] : reading_)
        text += fmt::format(", {} being brought for {:.1f} s", cache_.scene().pageable_name(block),
                            std::chrono::duration<double>(std::chrono::steady_clock::now() - since).count());
    return text;
}

Result<std::vector<Arrival>> Loader::arrived(bool wait) {
    std::vector<Arrival> blocks;
    std::unique_lock lock(mutex_);
    for (;;) {
        if (threads_.empty() && !waiting_.empty()) carry_out_first(lock);
        if (!failure_.ok()) return failure_;
        if (std::exchange(unflushed_, false)) {
            lock.unlock();
            RAYPAGER_TRY(device_.uploads().flush());
            lock.lock();
        }
        size_t done = 0;
        const Load* last_done = nullptr;
        const Load* under_way = nullptr;
        for (size_t i = 0; i < submitted_.size() && under_way == nullptr; i++) {
            if (!submitted_[i].upload) continue;
            auto finished = submitted_[i].upload->finished();
            if (!finished) return finished.status();
            (*finished ? last_done : under_way) = &submitted_[i];
            if (*finished) done = i + 1;
        }
        // Done already; but only a wait makes what was written visible to kernels of another queue (OpenCL 1.2, 5.9). The queue is in order.
        if (last_done) RAYPAGER_TRY(last_done->upload->wait());
        for (; done > 0; done--) {
            blocks.push_back(submitted_.front().arrival);
            cache_.release(submitted_.front().block);
            submitted_.pop_front();
        }
        if (!blocks.empty() || !wait) return blocks;
        if (under_way) {
            const Event upload = *under_way->upload;
            lock.unlock();
            RAYPAGER_TRY(upload.wait());
            lock.lock();
        } else if (!waiting_.empty() || !reading_.empty()) {
            changed_.wait(lock);
        } else {
            return blocks;
        }
    }
}

// Gets the blocks that are not held yet and starts the uploads.
Status Loader::bring(std::vector<Load>& loads) {
    try {
        for (Load& load : loads) {
            if (load.bytes.empty()) {
                const auto bytes = cache_.acquire(load.block, &given_up_);
                if (!bytes) return bytes.status();
                load.bytes = *bytes;
            }
            if (cache_.form() == BlockForm::stored && !cache_.scene().is_page(load.block)) {
                rp_block_header header;
                std::memcpy(&header, load.bytes.data(), sizeof header);
                load.arrival = {load.block, header.leaves_at, header.vertices_at};
            } else if (!cache_.scene().is_page(load.block)) {
                load.arrival.leaves_at = cache_.scene().first_block_entry_of(load.block);  // which streams ask of blocks of instances
            }
            device_.hooks().before_upload();
        }
        return submit(loads);
    } catch (const std::bad_alloc&) {
        return Status::failed("not enough host memory to load a block; give a smaller --host-limit");
    }
}

// Not under the lock that the render loop needs: drivers take their time, and while one thread asks, others wait. So as few calls as will do: the
// queue is in order, so it waits for an event once, and one event tells of all uploads before it; and it is flushed once for all that are there.
Status Loader::submit(std::vector<Load>& loads) {
    const std::lock_guard order(submitting_);
    for (Load& load : loads) {
        const bool waits_already = load.free.empty() || load.free.handle()() == last_free_.handle()(), last = &load == &loads.back();
        if (!waits_already) last_free_ = load.free;
        if (last) load.upload.emplace();
        RAYPAGER_TRY(device_.uploads().write(slabs_[load.address.slab], load.address.offset, load.bytes, last ? &*load.upload : nullptr,
                                             waits_already ? nullptr : &load.free));
    }
    {
        const std::lock_guard lock(mutex_);
        submitted_.insert(submitted_.end(), loads.begin(), loads.end());
        // At once: they may have arrived, and be brought again by another thread, before this one goes on.
        for (const Load& load : loads) reading_.erase(load.block);
        unflushed_ = !waiting_.empty();
        if (unflushed_) return {};
    }
    return device_.uploads().flush();
}

// After an error: other devices may need the room. (Those that are submitted are released by arrived(), or at the end.)
void Loader::release_unsubmitted(const std::vector<Load>& loads) {
    (void)device_.uploads().finish();
    for (const Load& load : loads) {
        const bool submitted = std::any_of(submitted_.begin(), submitted_.end(), [&](const Load& other) { return other.block == load.block; });
        if (!load.bytes.empty() && !submitted) cache_.release(load.block);
    }
}

void Loader::carry_out_first(std::unique_lock<std::mutex>& lock) {
    std::vector<Load> loads;
    const auto take = [&](std::optional<std::span<const std::byte>> bytes) {
        loads.push_back(waiting_.front());
        if (bytes) loads.back().bytes = *bytes;
        waiting_.pop_front();
        reading_[loads.back().block] = std::chrono::steady_clock::now();
        return bytes.has_value();
    };
    // Who waits for room in the cache must not hold blocks that are not submitted: a block that is not there is brought alone.
    // Nor does one that need not wait for rounds under way go with those that must.
    const auto may_join = [&] {
        return !waiting_.empty() && loads.size() < max_together && waiting_.front().free.handle()() == loads.front().free.handle()();
    };
    for (bool there = take(cache_.acquire_if_there(waiting_.front().block)); there && may_join();) {
        const auto bytes = cache_.acquire_if_there(waiting_.front().block);
        there = bytes && take(bytes);
    }
    lock.unlock();
    const Status status = bring(loads);
    device_.hooks().after_upload();
    lock.lock();
    if (status) return;
    release_unsubmitted(loads);
    for (const Load& load : loads) reading_.erase(load.block);
    if (failure_.ok()) failure_ = status;
}

void Loader::work() {
    std::unique_lock lock(mutex_);
    for (;;) {
        changed_.wait(lock, [&] { return stop_ || !waiting_.empty(); });
        if (stop_) return;
        carry_out_first(lock);
        changed_.notify_all();
    }
}

}  // namespace raypager
