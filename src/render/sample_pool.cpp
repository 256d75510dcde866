#include "render/sample_pool.hpp"

#include <algorithm>
#include <iterator>

namespace raypager {
namespace {

uint64_t sum(const std::vector<SampleRange>& ranges) {
    uint64_t all = 0;
    for (const SampleRange& range : ranges) all += range.size();
    return all;
}

}  // namespace

uint64_t next_share(uint64_t left, uint64_t in_the_beginning, uint64_t takers) {
    const uint64_t fewest = std::clamp<uint64_t>(in_the_beginning / (32 * takers), 1, 65536);
    return std::max(left / (4 * takers), fewest);
}

void SamplePool::add(std::vector<SampleRange> ranges) {
    const std::lock_guard lock(mutex_);
    ranges.insert(ranges.end(), ranges_.begin(), ranges_.end());
    ranges_ = merge_ranges(std::move(ranges));
    in_the_beginning_ = sum(ranges_);
}

std::optional<SampleRange> SamplePool::take() {
    const std::lock_guard lock(mutex_);
    if (ranges_.empty()) return std::nullopt;
    SampleRange& first = ranges_.front();
    const uint64_t most = devices_ == 1 ? first.size() : next_share(sum(ranges_), in_the_beginning_, devices_);
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

bool SamplePool::expects_more() const {
    const std::lock_guard lock(mutex_);
    return expects_more_ || !ranges_.empty() || !again_.empty();
}

void SamplePool::expect_more(bool more) {
    const std::lock_guard lock(mutex_);
    expects_more_ = more;
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
