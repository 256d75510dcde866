// The kinds of scene that make_scene dispatches to. options.triangles (of "points": points) is never 0 here
// (but for terrain from a height map: as the image), nor are the textures of a museum and their bytes, nor the instances of a forest or an island,
// nor the copies of that.
#pragma once

#include "procedural/make_scene.hpp"

namespace raypager {

Result<MadeScene> make_cornell(const MakeSceneOptions& options);
Result<MadeScene> make_terrain(const MakeSceneOptions& options);
Result<MadeScene> make_clutter(const MakeSceneOptions& options);
Result<MadeScene> make_museum(const MakeSceneOptions& options);
Result<MadeScene> make_forest(const MakeSceneOptions& options);
Result<MadeScene> make_island(const MakeSceneOptions& options);
Result<MadeScene> make_points(const MakeSceneOptions& options);

}  // namespace raypager
