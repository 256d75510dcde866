// Lights with a surface, as the list of lights for next-event estimation has them.
#pragma once

#include "raypager/scene.hpp"

namespace raypager {

// In the world. The triangle shines on the side from which its corners are seen counter-clockwise, the sphere outwards. probability is left 0.
rp_light triangle_light(const Float3& a, const Float3& b, const Float3& c, const AreaLight& light);
rp_light sphere_light(const Float3& center, float radius, const AreaLight& light);
// The same emitter with another area light's radiance and sides. probability is left 0.
rp_light shining_as(const rp_light& light, const AreaLight& area);
// The same light, but no ray meets it, and it casts no shadow. It may stand among Scene::lights.
rp_light unseen(rp_light light);

}  // namespace raypager
