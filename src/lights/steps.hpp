// Choices by a random number of 32 bits, as kernels make them (rp_choose_light).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace raypager {

// Of a choice with these probabilities, which sum up to 1, item i is chosen by the numbers from the last one of item i - 1 (exclusive) to steps[i]
// (inclusive). Each gets at least one of them.
std::vector<uint32_t> steps_of(std::span<const double> probabilities);
float share_of_step(std::span<const uint32_t> steps, size_t i);

}  // namespace raypager
