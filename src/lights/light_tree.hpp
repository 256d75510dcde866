// The tree by which lights that have a place are chosen.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "raypager/abi/light_tree.h"
#include "raypager/abi/scene.h"

namespace raypager {

struct LightTree {
    std::vector<rp_light_node> nodes;  // pairs
    std::vector<uint64_t> ways;        // of every light; 0: it is not in the tree
};

// What a light gives a surface that faces it and that it faces, times squared distance. At least 0.
double light_strength(const rp_light& light);

// placed: which lights are put in, two or more. Deterministic; 100,000 lights take less than a tenth of a second.
LightTree build_light_tree(std::span<const rp_light> lights, std::span<const uint32_t> placed);

}  // namespace raypager
