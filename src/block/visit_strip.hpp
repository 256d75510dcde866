// The triangles of a strip, as abi/block.h defines it.
#pragma once

#include <cstdint>

#include "raypager/abi/block.h"

namespace raypager {

// Calls visit(k, a, b, c) for triangle k in its true orientation, up to rotation. flags: bits 0-5 of the leaf's reference.
// vertices: as many as there are triangles and two more.
template <class Vertex, class Visit>
void visit_strip(uint32_t flags, const Vertex* vertices, Visit&& visit) {
    uint32_t a = 0, b = 1, c = 2;
    bool clockwise = flags & RP_LEAF_WINDING;
    for (uint32_t k = 0;; k++) {
        if (clockwise) {
            visit(k, vertices[a], vertices[c], vertices[b]);
        } else {
            visit(k, vertices[a], vertices[b], vertices[c]);
        }
        if (k == (flags & 3u)) return;
        const bool keeps_first = flags >> (2 + k) & 1u;
        if (!keeps_first) {
            a = b;
            clockwise = !clockwise;
        }
        b = c;
        c = k + 3;
    }
}

}  // namespace raypager
