// What grows on an island: each stands on y = 0, about the y axis. Lengths are metres. Leaves that are cards with images have coordinates of
// textures. Triangles are about as many as asked for; the least numbers are what the simplest form takes.
#pragma once

#include <cstdint>

#include "procedural/numeric.hpp"

namespace raypager {

// A slender trunk that leans, and arching fronds with leaflets on both sides.
struct Palm {
    TriangleMesh wood, leaves;
};
constexpr uint64_t min_palm_triangles = 120;
Palm grow_palm(uint64_t triangles, Random& random);

// Long narrow blades out of one point, as of screw pines.
constexpr uint64_t min_rosette_triangles = 8;
TriangleMesh grow_rosette(uint64_t triangles, Random& random);

// Fronds as folded cards, the image's bottom at the root.
constexpr uint64_t min_fern_triangles = 12;
TriangleMesh grow_fern(uint64_t triangles, Random& random);

// A round shrub; its flowers are cards.
struct Hedge {
    TriangleMesh leaves, flowers;
};
constexpr uint64_t min_hedge_triangles = 24;
Hedge grow_hedge(uint64_t triangles, Random& random);

// One leaf, about a metre long, that has fallen onto the ground.
constexpr uint64_t fallen_leaf_triangles = 9;
TriangleMesh make_fallen_leaf(Random& random);

}  // namespace raypager
