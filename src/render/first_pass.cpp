#include "render/first_pass.hpp"

#include <algorithm>

#include "wavefront/sample_order.hpp"

namespace raypager {

FirstPass::FirstPass(const rp_sample_order& order, uint32_t width, uint32_t height)
    : samples_(coarse_samples(order, 0, width, height, uint64_t{width} * height)) {
    // Points that are this far apart, as the list has them (coarse_samples). Steps that are small take as many rounds as others.
    constexpr uint64_t least = 5000;
    for (uint64_t apart = 8; apart > 0; apart /= 2) {
        const uint64_t end = ((width + apart - 1) / apart) * ((height + apart - 1) / apart);
        if (end >= least || apart == 1) ends_.push_back(end);
    }
}

bool FirstPass::due(uint64_t under_way) const {
    constexpr auto long_enough = std::chrono::milliseconds(250);
    return under_way <= step_size_ / 8 || Clock::now() - step_begin_ > long_enough;
}

std::vector<rp_path_sample> FirstPass::take_step() { return take(*std::upper_bound(ends_.begin(), ends_.end(), next_)); }
std::vector<rp_path_sample> FirstPass::take_rest() { return take(samples_.size()); }

std::vector<rp_path_sample> FirstPass::take(uint64_t end) {
    const auto at = [&](uint64_t i) { return samples_.begin() + static_cast<std::ptrdiff_t>(i); };
    std::vector<rp_path_sample> step(at(next_), at(end));
    step_size_ = step.size();
    step_begin_ = Clock::now();
    next_ = end;
    if (!pending()) *this = {};
    return step;
}

}  // namespace raypager
