#include "wavefront/sample_numbers.hpp"

#include <algorithm>

#include "base/check.hpp"

namespace raypager {

std::vector<SampleRange> merge_ranges(std::vector<SampleRange> ranges) {
    std::sort(ranges.begin(), ranges.end(), [](const SampleRange& a, const SampleRange& b) { return a.begin < b.begin; });
    std::vector<SampleRange> merged;
    for (const SampleRange& range : ranges) {
        if (range.size() == 0) continue;
        RAYPAGER_CHECK(merged.empty() || merged.back().end <= range.begin);
        if (!merged.empty() && merged.back().end == range.begin)
            merged.back().end = range.end;
        else
            merged.push_back(range);
    }
    return merged;
}

std::vector<SampleRange> ranges_of_both(const std::vector<SampleRange>& a, const std::vector<SampleRange>& b) {
    std::vector<SampleRange> both;
    for (size_t i = 0, j = 0; i < a.size() && j < b.size();) {
        const SampleRange range = {std::max(a[i].begin, b[j].begin), std::min(a[i].end, b[j].end)};
        if (range.begin < range.end) both.push_back(range);
        a[i].end < b[j].end ? i++ : j++;
    }
    return both;
}

std::vector<SampleRange> ranges_without(const std::vector<SampleRange>& a, const std::vector<SampleRange>& b) {
    std::vector<SampleRange> gaps;  // of b
    uint64_t end = 0;
    for (const SampleRange& range : b) {
        gaps.push_back({end, range.begin});
        end = range.end;
    }
    gaps.push_back({end, UINT64_MAX});
    return ranges_of_both(a, gaps);
}

void SampleNumbers::append(const SampleRange& range) {
    RAYPAGER_CHECK(range.begin <= range.end);
    if (range.size() == 0) return;
    if (!parts_.empty() && parts_.back().range.end == range.begin) {
        parts_.back().range.end = range.end;
        parts_.back().end_count += range.size();
    } else {
        parts_.push_back({range, count() + range.size()});
    }
}

void SampleNumbers::cut(uint64_t count) {
    RAYPAGER_CHECK(count <= this->count());
    while (!parts_.empty() && parts_.back().begin_count() >= count) parts_.pop_back();
    if (parts_.empty()) return;
    Part& last = parts_.back();
    last.range.end -= last.end_count - count;
    last.end_count = count;
}

size_t SampleNumbers::part_of(uint64_t count) const {
    const auto found = std::upper_bound(parts_.begin(), parts_.end(), count, [](uint64_t c, const Part& part) { return c < part.end_count; });
    return static_cast<size_t>(found - parts_.begin());
}

std::vector<SampleRange> SampleNumbers::from(uint64_t count) const {
    std::vector<SampleRange> ranges;
    for (const Part& part : parts_)
        if (part.end_count > count) ranges.push_back({part.range.begin + (std::max(count, part.begin_count()) - part.begin_count()), part.range.end});
    return ranges;
}

rp_sample_numbers SampleNumbers::for_round(uint64_t count) const {
    const size_t at = part_of(count);
    if (at == parts_.size()) return {this->count(), this->count(), 0, 0};
    const Part& part = parts_[at];
    const Part& next = at + 1 < parts_.size() ? parts_[at + 1] : part;
    return {part.end_count, next.end_count, part.range.begin - part.begin_count(), next.range.begin - next.begin_count()};
}

}  // namespace raypager
