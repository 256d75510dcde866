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
    Float2 uv = {};             // coordinates of textures; zeros: it has none
};

class VertexTable {
public:
    explicit VertexTable(size_t expected);
    uint32_t number(const VertexBits& vertex);
    size_t size() const { return vertices_.size(); }
    VertexBits operator[](size_t number) const;
    // All vertices, by number. The table is empty then.
    std::vector<VertexBits> take();

private:
    struct Plain {
        Float3 position;
        uint32_t normal, color;
    };
    bool is(uint32_t number, const VertexBits& vertex) const;
    uint32_t& find(const VertexBits& vertex, uint64_t hash);
    void enlarge();

    std::vector<Plain> vertices_;
    std::vector<Float2> uvs_;      // of the first so many vertices; most meshes have none, which then take no room
    std::vector<uint32_t> slots_;  // open addressing; at most half of them in use
    // The last ones asked for. Triangles that come one after the other share vertices, and this stays in the nearest cache.
    std::array<uint32_t, 256> recent_;
};

}  // namespace raypager
