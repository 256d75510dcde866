// A look at a mesh that may be too large for memory.
#pragma once

#include <cmath>

#include "raypager/scene.hpp"

namespace raypager {

struct MeshSample {
    TriangleMesh mesh;     // some of the triangles that can be seen, spread evenly over the file, with their vertices
    double triangles = 1;  // of the whole for one of these
    Float3 lower{INFINITY, INFINITY, INFINITY}, upper{-INFINITY, -INFINITY, -INFINITY};  // of all vertices
};

// At most `most` triangles, the same ones each time. Streams the mesh twice. issues: what is wrong with those of the sample.
Result<MeshSample> sample_mesh(const MeshSource& source, uint64_t most, MeshIssues& issues);

}  // namespace raypager
