// How large a block's form for CPUs (abi/wide.h) will be, and where its block entries' roots will lie there: what a maker of it would say, without
// making it.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "cut/bvh.hpp"
#include "raypager/abi/block.h"

namespace raypager {

struct WideSize {
    uint32_t bytes = 0;
    std::vector<rp_u32> roots;  // of bvh.block entries
};

// spheres: as they are stored, those of bvh.sphere_ids in their order.
WideSize measure_wide_form(const Bvh& bvh, std::span<const rp_sphere> spheres);

}  // namespace raypager
