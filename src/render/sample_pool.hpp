// The samples of a render that no device has been given yet: ranges of numbers, and single ones that are begun again. Devices take some when they are
// about to have begun what they had: the fewer are left, the fewer at a time, so that all end together.
#pragma once

#include <cstdint>
#include <mutex>
#include <optional>
#include <vector>

#include "raypager/abi/path.h"
#include "wavefront/sample_numbers.hpp"

namespace raypager {

// How many of those that are left one of so many takers gets: a quarter of its share, but not so few that it would have to come again after every
// round: at most 65536 then, and a part of what there was in the beginning.
uint64_t next_share(uint64_t left, uint64_t in_the_beginning, uint64_t takers);

class SamplePool {
public:
    // devices: that take from it. One gets everything at once.
    explicit SamplePool(uint32_t devices) : devices_(devices) {}

    void add(std::vector<SampleRange> ranges);
    // The next ones, in the order of their numbers; nothing if there are none.
    std::optional<SampleRange> take();
    // Samples whose paths were under way when a checkpoint was written, or when a device failed that had begun them.
    void add_again(const std::vector<rp_path_sample>& samples);
    // A device's share of them.
    std::vector<rp_path_sample> take_again();
    // What is there from this number on is not begun any more.
    void cut(uint64_t number);
    void clear();
    uint64_t left() const;  // numbers
    // Whether there are samples, or more will come. Those that a device gives back when it fails are not foreseen.
    bool expects_more() const;
    void expect_more(bool more);
    std::vector<rp_path_sample> again() const;
    std::vector<SampleRange> ranges() const;
    void set_devices(uint32_t devices);

private:
    mutable std::mutex mutex_;
    uint32_t devices_;
    uint64_t in_the_beginning_ = 0;    // when samples were last added
    std::vector<SampleRange> ranges_;  // sorted
    std::vector<rp_path_sample> again_;
    size_t again_share_ = 0;
    bool expects_more_ = false;  // though none are left
};

}  // namespace raypager
