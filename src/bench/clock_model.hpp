// A model of time: rounds have a cost of their own, rays take turns, and what is moved takes its share of the device's or the host's time. For limits
// that nothing can be measured within, because the device has too little memory.
#pragma once

#include <span>
#include <vector>

#include "bench/pilot.hpp"

namespace raypager::bench {

struct ClockModel {
    double per_ray = 0, per_round = 0, per_byte = 0;  // seconds; none is negative
    double seconds(double rays, double rounds, double bytes) const { return per_ray * rays + per_round * rounds + per_byte * bytes; }
};

// What explains these seconds best (least squares of relative errors, over all costs that are not negative). Extents without seconds are left out.
// With fewer of them than costs, the costs that are not needed are 0.
ClockModel fit_clock(std::span<const Extent> measured);

}  // namespace raypager::bench
