#include "render/sample_pool.hpp"

#include <algorithm>
#include <iterator>

namespace raypager {
namespace {

// Of what is left, each device takes a quarter of its share, but not so few that it would have to come again after every round: at most so many, and
// of what there was in the beginning a part.
constexpr uint64_t shares = 4, fewest = 65536, parts = 32;

uint64_t sum(const std::vector<SampleRange>& ranges) {
    uint64_t all = 0;
    for (const SampleRange& range : ranges) all += range.size();
    return all;
}

}  // namespace

void SamplePool::add(std::vector<SampleRange> ranges) {
    const std::lock_guard lock(mutex_);
    ranges.insert(ranges.end(), ranges_.begin(), ranges_.end());
    ranges_ = merge_ranges(std::move(ranges));
    fewest_ = std::clamp<uint64_t>(sum(ranges_) / (parts * devices_), 1, fewest);
}

std::optional<SampleRange> SamplePool::take() {
    const std::lock_guard lock(mutex_);
    if (ranges_.empty()) return std::nullopt;
    SampleRange& first = ranges_.front();
    const uint64_t most = devices_ == 1 ? first.size() : std::max(sum(ranges_) / (shares * devices_), fewest_);
    const SampleRange taken = {first.begin, first.begin + std::min(first.size(), most)};
    first.begin = taken.end;
    if (first.size() == 0) ranges_.erase(ranges_.begin());
    return taken;
}

void SamplePool::add_again(const std::vector<rp_path_sample>& samples) {
    const std::lock_guard lock(mutex_);
    again_.insert(again_.end(), samples.begin(), samples.end());
    again_share_ = (again_.size() + devices_ - 1) / devices_;
}

std::vector<rp_path_sample> SamplePool::take_again() {
    const std::lock_guard lock(mutex_);
    const size_t count = std::min(again_.size(), again_share_);
    std::vector<rp_path_sample> taken(again_.end() - static_cast<std::ptrdiff_t>(count), again_.end());
    again_.resize(again_.size() - count);
    return taken;
}

std::vector<rp_path_sample> SamplePool::again() const {
    const std::lock_guard lock(mutex_);
    return again_;
}

void SamplePool::cut(uint64_t number) {
    const std::lock_guard lock(mutex_);
    std::erase_if(ranges_, [number](const SampleRange& range) { return range.begin >= number; });
    if (!ranges_.empty()) ranges_.back().end = std::min(ranges_.back().end, number);
}

void SamplePool::clear() {
    const std::lock_guard lock(mutex_);
    ranges_.clear();
    again_.clear();
}

uint64_t SamplePool::left() const {
    const std::lock_guard lock(mutex_);
    return sum(ranges_);
}

std::vector<SampleRange> SamplePool::ranges() const {
    const std::lock_guard lock(mutex_);
    return ranges_;
}

void SamplePool::set_devices(uint32_t devices) {
    const std::lock_guard lock(mutex_);
    devices_ = std::max(devices, 1u);
}

}  // namespace raypager
