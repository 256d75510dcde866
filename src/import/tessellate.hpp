// Curved shapes as meshes, for those that the engine does not trace exactly.
#pragma once

#include "raypager/scene.hpp"

namespace raypager {

// All in object space as pbrt defines them, with normals, oriented outwards (disk: towards +z). sweep: radians about z, up to 2 pi.
TriangleMesh tessellate_sphere(double radius);
TriangleMesh tessellate_disk(double height, double radius, double inner_radius, double sweep);
TriangleMesh tessellate_cylinder(double radius, double z_min, double z_max, double sweep);

}  // namespace raypager
