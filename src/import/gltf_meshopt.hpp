// Buffer views of glTF that meshoptimizer has packed (EXT_meshopt_compression).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "raypager/status.hpp"

namespace raypager {

// As the extension has them; nothing has been checked.
struct MeshoptView {
    std::string mode, filter;
    int64_t count = 0, stride = 0;  // elements, and bytes of each
};

// count * stride bytes. An error says what is wrong, without a place.
Result<std::vector<std::byte>> unpack_meshopt(const MeshoptView& view, std::span<const std::byte> packed);

}  // namespace raypager
