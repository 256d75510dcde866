#include "residency/loader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <new>
#include <utility>

#include "base/fault_plan.hpp"

namespace raypager {
namespace {

// A thread reads and verifies some GB/s; a few of them keep up with a fast disk and with the bus, where there are cores to spare.
size_t thread_count() { return std::clamp<size_t>(std::thread::hardware_concurrency() / 4, 1, 4); }

}  // namespace

std::unique_ptr<Loader> Loader::create(Device& device, HostCache& cache, const std::vector<Buffer>& slabs, uint32_t threads) {
    std::unique_ptr<Loader> loader(new Loader(device, cache, slabs));
    if (device.thread_safe())
        for (size_t i = 0; i < (threads ? threads : thread_count()); i++) loader->threads_.emplace_back([raw = loader.get()] { raw->work(); });
    return loader;
}

Loader::~Loader() {
    {
        const std::lock_guard lock(mutex_);
        stop_ = true;
    }
    changed_.notify_all();
    cache_.close();
    for (std::thread& thread : threads_) thread.join();
    (void)device_.uploads().finish();  // they read the cache's memory
}

void Loader::start(std::span<const PlannedLoad> loads, const Event& free) {
    if (loads.empty()) return;
    {
        const std::lock_guard lock(mutex_);
        for (const PlannedLoad& load : loads) waiting_.push_back({load.block, load.address, free, {}, {}});
    }
    changed_.notify_all();
}

uint32_t Loader::under_way() const {
    const std::lock_guard lock(mutex_);
    return static_cast<uint32_t>(waiting_.size() + submitted_.size() + reading_.size());
}

std::string Loader::activity() const {
    const std::lock_guard lock(mutex_);
    std::string text = fmt::format("{} loads to begin, {} uploads under way", waiting_.size(), submitted_.size());
    for (const auto& [block, since] : reading_)
        text += fmt::format(", block {} being brought for {:.1f} s", block,
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
        for (; done < submitted_.size(); done++) {
            auto finished = submitted_[done].upload.finished();
            if (!finished) return finished.status();
            if (!*finished) break;
        }
        // Done already; but only a wait makes what was written visible to kernels of another queue (OpenCL 1.2, 5.9). The queue is in order.
        if (done > 0) RAYPAGER_TRY(submitted_[done - 1].upload.wait());
        for (; done > 0; done--) {
            blocks.push_back(submitted_.front().arrival);
            cache_.release(submitted_.front().block);
            submitted_.pop_front();
        }
        if (!blocks.empty() || !wait) return blocks;
        if (!submitted_.empty()) {
            // Only this thread takes uploads off the list, so the event stays valid without the lock.
            const Event upload = submitted_.front().upload;
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

// Gets a block and starts its upload.
Status Loader::bring(Load& load) {
    try {
        const auto bytes = cache_.acquire(load.block);
        if (!bytes) return bytes.status();
        load.arrival = {load.block, 0, 0};
        if (cache_.form() == BlockForm::stored) {
            rp_block_header header;
            std::memcpy(&header, bytes->data(), sizeof header);
            load.arrival = {load.block, header.leaves_at, header.vertices_at};
        }
        inject_delay();
        // Not under the lock that the render loop needs: drivers take their time. So as few calls as will do: the queue is in order, so it
        // waits for an event once; and it is flushed once for all loads that are there.
        const std::lock_guard order(submitting_);
        const bool waits_already = load.free.handle()() == last_free_.handle()();
        last_free_ = load.free;
        RAYPAGER_TRY(
            device_.uploads().write(slabs_[load.address.slab], load.address.offset, *bytes, &load.upload, waits_already ? nullptr : &load.free));
        {
            const std::lock_guard lock(mutex_);
            submitted_.push_back(load);
            unflushed_ = !waiting_.empty();
            if (unflushed_) return {};
        }
        return device_.uploads().flush();
    } catch (const std::bad_alloc&) {
        return Status::failed("not enough host memory to load a block; give a smaller --host-limit");
    }
}

void Loader::carry_out_first(std::unique_lock<std::mutex>& lock) {
    Load load = waiting_.front();
    waiting_.pop_front();
    reading_[load.block] = std::chrono::steady_clock::now();
    lock.unlock();
    const Status status = bring(load);
    lock.lock();
    reading_.erase(load.block);
    if (!status.ok() && failure_.ok()) failure_ = status;
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
