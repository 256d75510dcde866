// What meshes and clouds that come without a scene are made of, what they stand on, and the light that falls on them.
#pragma once

#include <optional>

#include "import/framing.hpp"
#include "raypager/scene.hpp"
#include "scene/vector.hpp"

namespace raypager {

struct BareLight {
    enum class Kind { usual, none, key, sun };  // usual: the sun over landscapes, a key light elsewhere
    struct Place {
        double azimuth = 0, elevation = 0;  // degrees: to the right of the first view, and above the ground
    };
    Kind kind = Kind::usual;
    std::optional<Place> place;  // of the sun
    double strength = 1;         // times as bright as usual
};

struct BareLook {
    std::optional<rp_material> material;  // of all meshes and clouds; none: as their files say, clay where they do not
    std::optional<Float3> sky;            // radiance; black: there is none; not given: dim, or blue over landscapes
    BareLight light;
    bool no_ground = false;          // objects stand on one otherwise; landscapes have their own
    uint32_t width = 0, height = 0;  // of the picture that is framed; 0: as a Scene has it
};

// What stands in the picture, in the scene's units.
struct BareSubject {
    Vector center = {};
    double radius = 0;  // of the sphere around its bounds
    double lowest = 0;  // along the axis that points up
    bool landscape = false;
    bool points = false;  // some of it are points, which reach down further than their centres
};

// Sets lights and ground. REQUIRES: the material `ground_material` exists.
void light_bare_scene(const BareLook& look, const BareSubject& subject, const Framing& view, const Axes& axes, uint32_t ground_material,
                      Scene& scene);

}  // namespace raypager
