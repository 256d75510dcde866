// What grows and lies in a forest: each stands on y = 0, about the y axis. Lengths are metres.
#pragma once

#include <cstdint>

#include "procedural/numeric.hpp"

namespace raypager {

enum class TreeHabit { conifer, broadleaf };

struct Tree {
    TriangleMesh wood, leaves;  // tapered tubes, open where they are rooted; quads
};

// As many triangles as asked for, or one less. REQUIRES: at least min_tree_triangles.
constexpr uint64_t min_tree_triangles = 60;
Tree grow_tree(TreeHabit habit, uint64_t triangles, Random& random);

// Blades of three triangles on about a square metre. REQUIRES: triangles >= 3.
TriangleMesh grow_tuft(uint64_t triangles, Random& random);

// A closed lump of about so many triangles, about a metre across, its middle at the origin.
TriangleMesh make_rock(uint64_t triangles, Random& random);

}  // namespace raypager
