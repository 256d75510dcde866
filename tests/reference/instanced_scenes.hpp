// Scenes with instances, for tests.
#pragma once

#include "raypager/scene.hpp"
#include "reference/scenes.hpp"

namespace raypager::reference {

// So many instances of objects of all kinds of primitives and materials, strewn over a floor: turned, mirrored, uneven, sheared, far too large and
// far too small, within each other and beside what is placed once. round: spheres, which are round in the scene that is written out as well, too.
Scene strewn(uint32_t instances, PictureSize size = {}, bool round = true);
// Instances of lanterns, which shine on one side, on both, and unseen, and of bulbs, some of them with other colours or materials than their objects:
// turned, mirrored, uneven. Lamps of the scene's own are among them.
Scene strewn_lanterns(uint32_t instances, PictureSize size = {});
// Groves of trees of twigs of leaves: instances in each other, three levels deep, beside instances and shapes of the world itself. Objects hold both
// shapes and instances, or one of them. scattered: so far from the world's origin. berries: spheres, which copies
// of uneven instances are not.
Scene groves(uint32_t trees, PictureSize size = {}, double scattered = 0, bool berries = true);
// The same scene with a shape for each shape of each instance, and a material for each colour. Colours must not be those of instances with textures,
// or of points or vertices with colours.
Scene written_out(const Scene& scene);

}  // namespace raypager::reference
