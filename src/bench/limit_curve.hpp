// How long a render takes within limits of geometry, between those that are known.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

namespace raypager::bench {

struct LimitPoint {
    uint64_t geometry_bytes = 0;
    double seconds = 0;
};

// The smallest limit within which the render takes so long at most: between points straight lines over the logarithm of the limit. More geometry
// never takes longer: where a point says otherwise, by chance, it takes as long as with less. None: no point is so quick, or there are no two limits.
// REQUIRES: points in the order of their limits, the smallest first; none is 0.
std::optional<uint64_t> limit_for(std::span<const LimitPoint> points, double seconds);

}  // namespace raypager::bench
