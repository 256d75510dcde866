// What lies on a beach, each about a metre across, to be made smaller where it is placed. Triangles are about as many as asked for.
#pragma once

#include <cstdint>

#include "procedural/numeric.hpp"

namespace raypager {

// The spiral of a snail.
TriangleMesh make_shell(uint64_t triangles, Random& random);

// Branches that rise from one point.
TriangleMesh make_coral(uint64_t triangles, Random& random);

// A bleached trunk with the stumps of two branches; lies along x.
TriangleMesh make_driftwood(uint64_t triangles, Random& random);

}  // namespace raypager
