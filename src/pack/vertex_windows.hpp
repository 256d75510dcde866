// The order of a block's vertices. A strip names its vertices by a byte each within a window of 256 vertices that starts at a multiple
// of RP_CLUSTER_UNIT. Windows may overlap: the vertices form one sequence, and a strip uses again what was appended not long ago.
// Only what lies too far behind is appended a second time.
#pragma once

#include <cstdint>
#include <vector>

#include "raypager/abi/block.h"

namespace raypager {

class VertexWindows {
public:
    explicit VertexWindows(uint32_t vertex_count) : places_(vertex_count, RP_NONE) {}

    struct Reference {
        uint32_t first;                             // of the window
        uint8_t bytes[RP_LEAF_MAX_PRIMITIVES + 2];  // unused ones repeat the last
    };
    // Appends what is missing. count: at most RP_LEAF_MAX_PRIMITIVES + 2.
    Reference place(const uint32_t* vertices, uint32_t count);
    // Vertex numbers in sequence, with repetitions.
    const std::vector<uint32_t>& sequence() const { return sequence_; }

private:
    std::vector<uint32_t> places_;  // where each vertex was last appended
    std::vector<uint32_t> sequence_;
};

}  // namespace raypager
