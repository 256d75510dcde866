// Which samples a device begins: ranges of their numbers (wavefront/sample_order.hpp), one after the other. The device itself only counts how many it
// has begun by number; a count and these ranges say which ones.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "raypager/abi/scene.h"

namespace raypager {

struct SampleRange {
    uint64_t begin = 0, end = 0;  // numbers
    uint64_t size() const { return end - begin; }
    bool operator==(const SampleRange&) const = default;
};

// Sorted, without gaps between neighbours that touch, and without empty ones. REQUIRES: they do not overlap.
std::vector<SampleRange> merge_ranges(std::vector<SampleRange> ranges);

// Those numbers of both, and those of the first alone. REQUIRES: both are as merge_ranges has them.
std::vector<SampleRange> ranges_of_both(const std::vector<SampleRange>& a, const std::vector<SampleRange>& b);
std::vector<SampleRange> ranges_without(const std::vector<SampleRange>& a, const std::vector<SampleRange>& b);

class SampleNumbers {
public:
    // So many are begun, with those that come later.
    uint64_t count() const { return parts_.empty() ? 0 : parts_.back().end_count; }
    void append(const SampleRange& range);
    // Behind the first so many none are begun. REQUIRES: not more than count().
    void cut(uint64_t count);
    // Those that are begun after so many others.
    std::vector<SampleRange> from(uint64_t count) const;
    // For a round that is started when at least so many have been begun: the range that they end in, and the next one.
    rp_sample_numbers for_round(uint64_t count) const;

private:
    struct Part {
        SampleRange range;
        uint64_t end_count = 0;  // samples up to its end
        uint64_t begin_count() const { return end_count - range.size(); }
    };
    size_t part_of(uint64_t count) const;  // parts_.size(): behind all

    std::vector<Part> parts_;
};

}  // namespace raypager
