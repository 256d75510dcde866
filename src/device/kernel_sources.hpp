// The kernel sources that the build put into the program (cmake/EmbedKernels.cmake).
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

namespace raypager {

struct KernelSource {
    std::string_view name;  // as in #include: "common/box.cl", "raypager/abi/block.h"
    std::string_view text;
};
const std::vector<KernelSource>& kernel_sources();

}  // namespace raypager
