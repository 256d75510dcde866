// What meshes and clouds that come without a scene are made of, what they stand on, and the light that falls on them.
#pragma once

#include "import/framing.hpp"
#include "raypager/import.hpp"
#include "raypager/scene.hpp"
#include "scene/vector.hpp"

namespace raypager {

// What stands in the picture, in the scene's units.
struct BareSubject {
    Vector center = {};
    double radius = 0;  // of the sphere around its bounds
    double lowest = 0;  // along the axis that points up
    bool landscape = false;
    bool points = false;  // some of it are points, which reach down further than their centres
};

rp_material bare_ground_material();

// Sets lights and ground. REQUIRES: the material `ground_material` exists.
void light_bare_scene(const BareLook& look, const BareSubject& subject, const Framing& view, const Axes& axes, uint32_t ground_material,
                      Scene& scene);

}  // namespace raypager
