// The first sample of each pixel, coarse to fine: some points all over the picture come first, then those between them, so that who watches sees all
// of it early.
#pragma once

#include <chrono>
#include <cstdint>
#include <vector>

#include "raypager/abi/path.h"
#include "raypager/abi/scene.h"

namespace raypager {

class FirstPass {
public:
    FirstPass() = default;
    FirstPass(const rp_sample_order& order, uint32_t width, uint32_t height);

    // Whether some of them have not been handed out.
    bool pending() const { return next_ < samples_.size(); }
    uint64_t left() const { return samples_.size() - next_; }
    // The next step may follow: of the one before it few paths are left, or it takes long because these wait. under_way: rays.
    bool due(uint64_t under_way) const;
    // The points of the next step; all that are left.
    std::vector<rp_path_sample> take_step();
    std::vector<rp_path_sample> take_rest();

private:
    using Clock = std::chrono::steady_clock;
    std::vector<rp_path_sample> take(uint64_t end);

    std::vector<rp_path_sample> samples_;
    std::vector<uint64_t> ends_;  // of steps
    uint64_t next_ = 0, step_size_ = 0;
    Clock::time_point step_begin_;
};

}  // namespace raypager
