// Numbers vertices in the order in which they are met; vertices that are the same in every bit are one.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "raypager/abi/types.h"
#include "raypager/scene.hpp"

namespace raypager {

struct VertexBits {
    Float3 position;
    uint32_t normal = RP_NONE;  // octahedral; RP_NONE: it has none
    uint32_t color = RP_NONE;   // as in abi/block.h; RP_NONE: it has none
};

class VertexTable {
public:
    explicit VertexTable(size_t expected);
    uint32_t number(const VertexBits& vertex);
    const std::vector<VertexBits>& vertices() const { return vertices_; }
    std::vector<VertexBits> take() { return std::move(vertices_); }

private:
    uint32_t& find(const VertexBits& vertex, uint64_t hash);
    void enlarge();

    std::vector<VertexBits> vertices_;
    std::vector<uint32_t> slots_;  // open addressing; at most half of them in use
    // The last ones asked for. Triangles that come one after the other share vertices, and this stays in the nearest cache.
    std::array<uint32_t, 256> recent_;
};

}  // namespace raypager
