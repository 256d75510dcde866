// What a compiler sees of kernel sources, for telling whether two programs draw the same picture.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "device/kernel_sources.hpp"

namespace raypager {

// The text without comments and with white space only where it means something: texts that differ in comments and layout alone become the same.
std::string kernel_tokens(std::string_view text);

// A hash of the tokens of these stages ("single_ray/extend" is kernels/single_ray/extend.cl) and of all that they include, whatever the conditions.
// Names of files count, the order of sources does not.
uint64_t kernels_identity(std::span<const KernelSource> sources, std::span<const std::string_view> stages);

}  // namespace raypager
