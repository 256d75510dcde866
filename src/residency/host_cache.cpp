#include "residency/host_cache.hpp"

#include <algorithm>
#include <cstring>

namespace raypager {

Status HostCache::fetch(uint32_t block, std::span<std::byte> target) {
    Bytes cached;
    {
        const std::lock_guard lock(mutex_);
        if (const auto found = entries_.find(block); found != entries_.end()) {
            by_age_.splice(by_age_.end(), by_age_, found->second.age);
            cached = found->second.bytes;
        }
    }
    if (cached) {
        std::memcpy(target.data(), cached->data(), target.size());
        return {};
    }
    RAYPAGER_TRY(file_.read_block(block, target));
    RAYPAGER_TRY(file_.check_block(block, target));
    if (target.size() <= limit_) keep(block, std::make_shared<const std::vector<std::byte>>(target.begin(), target.end()));
    return {};
}

void HostCache::keep(uint32_t block, Bytes bytes) {
    const std::lock_guard lock(mutex_);
    if (entries_.count(block)) return;
    while (bytes_ + bytes->size() > limit_ && !by_age_.empty()) {
        const auto oldest = entries_.find(by_age_.front());
        bytes_ -= oldest->second.bytes->size();
        entries_.erase(oldest);
        by_age_.pop_front();
    }
    bytes_ += bytes->size();
    peak_ = std::max(peak_, bytes_);
    by_age_.push_back(block);
    entries_[block] = Entry{std::move(bytes), std::prev(by_age_.end())};
}

}  // namespace raypager
