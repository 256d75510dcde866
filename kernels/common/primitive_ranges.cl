// Which range a primitive belongs to (rp_primitive_range), and whether it stops a shadow ray for certain.
#ifndef RP_PRIMITIVE_RANGES_CL
#define RP_PRIMITIVE_RANGES_CL

#include "raypager/abi/scene.h"

static inline uint rp_find_range(const __global rp_primitive_range* ranges, uint count, uint primitive) {
    uint low = 0u, high = count - 1u;
    while (low < high) {
        const uint middle = (low + high + 1u) >> 1u;
        if (ranges[middle].first_primitive <= primitive)
            low = middle;
        else
            high = middle - 1u;
    }
    return low;
}

#ifdef RP_CUTOUTS
static inline bool rp_may_be_nothing(const __global rp_primitive_range* ranges, uint count, uint primitive) {
    return (ranges[rp_find_range(ranges, count, primitive)].flags & RP_RANGE_CUTOUT) != 0u;
}
// The same of several primitives, which are mostly of one range: a bit of each.
static inline uint rp_which_may_be_nothing(const __global rp_primitive_range* ranges, uint range_count, const __global uint* primitives, uint count) {
    uint first = 0u, end = 0u, found = 0u;  // primitives of the range looked at last
    bool nothing = false;
    for (uint i = 0u; i < count; i++) {
        if (primitives[i] < first || primitives[i] >= end) {
            const uint range = rp_find_range(ranges, range_count, primitives[i]);
            nothing = (ranges[range].flags & RP_RANGE_CUTOUT) != 0u;
            first = ranges[range].first_primitive;
            end = range + 1u < range_count ? ranges[range + 1u].first_primitive : ~0u;
        }
        found |= (nothing ? 1u : 0u) << i;
    }
    return found;
}
#endif

#endif
