#include "residency/loader.hpp"

#include "base/check.hpp"
#include "residency/transcode.hpp"

namespace raypager {

Result<std::unique_ptr<Loader>> Loader::create(Device& device, const BakedScene& scene, HostCache& cache, const std::vector<Buffer>& slabs,
                                               uint32_t staging_count) {
    std::unique_ptr<Loader> loader(new Loader(device, scene, cache, slabs));
    uint64_t largest = RP_BLOCK_ALIGNMENT;
    for (const BlockRecord& block : scene.blocks) largest = std::max<uint64_t>(largest, std::max(block.stored_bytes, block.memory_bytes));
    for (uint32_t i = 0; i < staging_count; i++) {
        auto pinned = device.allocate_pinned(largest);
        if (!pinned) return pinned.status();
        loader->staging_.push_back(std::move(*pinned));
        loader->free_staging_.push_back(i);
    }
    loader->thread_ = std::thread([raw = loader.get()] { raw->work(); });
    return loader;
}

Loader::~Loader() {
    {
        const std::lock_guard lock(mutex_);
        stop_ = true;
    }
    changed_.notify_all();
    if (thread_.joinable()) thread_.join();
    for (const Load& load : submitted_) (void)load.upload.wait();
}

void Loader::start(uint32_t block, PoolAddress address) {
    const std::lock_guard lock(mutex_);
    RAYPAGER_CHECK(!free_staging_.empty());
    waiting_.push_back({block, address, free_staging_.back(), {}});
    free_staging_.pop_back();
    changed_.notify_all();
}

uint32_t Loader::under_way() const {
    const std::lock_guard lock(mutex_);
    return static_cast<uint32_t>(waiting_.size() + submitted_.size() + reading_);
}

Result<std::vector<uint32_t>> Loader::arrived(bool wait) {
    std::vector<uint32_t> blocks;
    std::unique_lock lock(mutex_);
    for (;;) {
        if (!failure_.ok()) return failure_;
        while (!submitted_.empty()) {
            auto finished = submitted_.front().upload.finished();
            if (!finished) return finished.status();
            if (!*finished) break;
            // Done already; but only a wait makes what was written visible to kernels of another queue (OpenCL 1.2, 5.9).
            RAYPAGER_TRY(submitted_.front().upload.wait());
            blocks.push_back(submitted_.front().block);
            free_staging_.push_back(submitted_.front().staging);
            submitted_.pop_front();
        }
        if (!blocks.empty() || !wait) return blocks;
        if (!submitted_.empty()) {
            // Only this thread takes uploads off the list, so the event stays valid without the lock.
            const Event upload = submitted_.front().upload;
            lock.unlock();
            RAYPAGER_TRY(upload.wait());
            lock.lock();
        } else if (!waiting_.empty() || reading_) {
            changed_.wait(lock);
        } else {
            return blocks;
        }
    }
}

// Reads a block and starts its upload.
Status Loader::bring(Load& load) {
    try {
        const BlockRecord& record = scene_.blocks[load.block];
        const std::span<std::byte> bytes = staging_[load.staging].bytes();
        RAYPAGER_TRY(cache_.fetch(load.block, bytes.first(record.stored_bytes)));
        RAYPAGER_TRY(transcode_block(bytes, record));
        RAYPAGER_TRY(device_.uploads().write(slabs_[load.address.slab], load.address.offset, bytes.first(record.memory_bytes), &load.upload));
        return device_.uploads().flush();
    } catch (const std::bad_alloc&) {
        return Status::failed("not enough host memory to load a block; give a smaller --host-limit");
    }
}

void Loader::work() {
    std::unique_lock lock(mutex_);
    for (;;) {
        changed_.wait(lock, [&] { return stop_ || !waiting_.empty(); });
        if (stop_) return;
        Load load = waiting_.front();
        waiting_.pop_front();
        reading_ = 1;
        lock.unlock();
        const Status status = bring(load);
        lock.lock();
        reading_ = 0;
        if (status.ok())
            submitted_.push_back(load);
        else if (failure_.ok())
            failure_ = status;
        changed_.notify_all();
    }
}

}  // namespace raypager
