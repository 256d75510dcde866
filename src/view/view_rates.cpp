#include "view/view_rates.hpp"

namespace raypager {
namespace {

constexpr double window = 1, between = 0.1;  // seconds

}  // namespace

void RateMeter::add(double seconds, const RenderProgress& progress) {
    // The youngest follows the counts; it stays once it is old enough.
    if (samples_.size() >= 2 && seconds - samples_[samples_.size() - 2].seconds < between) samples_.pop_back();
    samples_.push_back({seconds, progress.rays, progress.loads, progress.bytes_loaded});
    while (samples_.size() > 2 && seconds - samples_[1].seconds > window) samples_.pop_front();
}

ViewRates RateMeter::rates() const {
    if (samples_.size() < 2) return {};
    const Sample &first = samples_.front(), &last = samples_.back();
    const double seconds = last.seconds - first.seconds;
    if (!(seconds > 0)) return {};
    const auto rate = [&](uint64_t from, uint64_t to) { return static_cast<double>(to - from) / seconds; };
    return {rate(first.rays, last.rays), rate(first.loads, last.loads), rate(first.bytes, last.bytes)};
}

}  // namespace raypager
