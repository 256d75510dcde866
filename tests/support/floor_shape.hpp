// What tests put things on.
#pragma once

#include <memory>

#include "raypager/scene.hpp"

namespace raypager::support {

// A square from -10 to 10 at z = 0 that faces up, of material 0.
inline Shape floor_shape() {
    TriangleMesh mesh;
    mesh.positions = {{-10, -10, 0}, {10, -10, 0}, {10, 10, 0}, {-10, 10, 0}};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    Shape shape;
    shape.name = "floor";
    shape.mesh = std::make_shared<MeshInMemory>("floor", std::move(mesh));
    return shape;
}

}  // namespace raypager::support
