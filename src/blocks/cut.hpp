// Cuts all primitives of a scene into parts that become blocks.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "blocks/world.hpp"

namespace raypager {

struct Part {
    size_t begin, end;  // among the refs
};

// Reorders refs and cuts them, by the surface area heuristic over whole primitives, into consecutive parts whose estimated bytes
// (PrimitiveRef::weight) are at most limit, or that are a single primitive. The parts come in depth-first order of the cut, so that
// neighbours in the list are neighbours in space. The result does not depend on the number of threads.
std::vector<Part> cut(std::span<PrimitiveRef> refs, uint64_t limit);

// One step of it: the number of refs, at least two, that belong to the first half; they are moved to the front.
size_t cut_in_two(std::span<PrimitiveRef> refs);

}  // namespace raypager
