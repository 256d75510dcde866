// What the device needs to choose lights for next-event estimation.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "raypager/abi/scene.h"

namespace raypager {

// Whether lights are chosen by what they could give at a place (abi/light_tree.h), not by their probabilities alone. A single lamp needs none, be it
// two triangles.
bool has_light_tree(std::span<const rp_light> lights);

// The words by which kernels choose (kernels/shading/light.cl; with a tree, light_tree.cl). Probabilities become exactly the shares of numbers that
// lights get; beside a tree those of lights that have a place mean nothing from then on.
std::vector<uint32_t> light_choice(std::vector<rp_light>& lights);
uint64_t light_choice_bytes(std::span<const rp_light> lights);

}  // namespace raypager
