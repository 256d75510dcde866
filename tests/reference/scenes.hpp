// Small scenes in memory whose pictures, or hits, are known or checked. All sizes can be changed; what is random depends on the seed.
#pragma once

#include <cstdint>

#include "raypager/picture.hpp"
#include "raypager/scene.hpp"
#include "reference/vector.hpp"

namespace raypager::reference {

struct PictureSize {
    uint32_t width = 96, height = 64;
};

// Light transport ------------------------------------------------------------------------------------------------------------

struct CornellOptions {
    bool sphere_primitives = false;  // the mirror and glass balls; otherwise meshes of 20 * 4^subdivisions triangles each
    bool smooth_normals = false;     // of the balls, where they are meshes
    uint32_t subdivisions = 3;
    uint32_t wall_divisions = 8;  // 2 * divisions^2 triangles a wall
};
// Diffuse walls, an area light below the ceiling, a mirror ball, a glass ball, a block of rough metal.
Scene cornell_small(const CornellOptions& options = {}, PictureSize size = {64, 64});

// The same room by unseen lights: a ball between the others, which hides nothing, and two triangles, one of which shines to both sides.
Scene cornell_unseen(PictureSize size = {64, 64});

// Balls and a checkered floor in an even light, near and far, seen by another camera than a pinhole and through a pixel filter.
enum class ViewKind { lens, orthographic, orthographic_lens, equirectangular, equal_area, shifted };
Scene balls_on_a_floor(ViewKind view, const PixelFilter& filter = {}, PictureSize size = {64, 48});
// Hills, a mirror, rough metal and glass under a sky that is an image of so many pixels a side, turned and mirrored, with a bright spot.
Scene sky_small(uint32_t n = 48, PictureSize size = {}, uint32_t pixels = 24);
// Such an image.
Image spotted_sky(uint32_t pixels);
// A room lit by a spot light, a lamp that shines through an image of all directions, and the projection of an image.
Scene lamps_small(PictureSize size = {});

enum class FurnaceKind {
    closed,           // inside a white-hot sphere that reflects as well: radiance * (1 + albedo + ... + albedo^max_depth) everywhere
    diffuse,          // a diffuse ball under an even sky: albedo * radiance
    mirror,           // a mirror that loses nothing, under an even sky: radiance
    rough_conductor,  // rough metal that loses nothing but multiple scattering, under an even sky: at most radiance
    glass,            // a glass ball under an even sky: radiance
};
struct Furnace {
    Scene scene;          // the object covers the whole picture
    double expected = 0;  // in every pixel, for scene.max_depth and unit radiance; an upper bound for rough_conductor
};
// albedo: of closed and diffuse. alpha: of rough_conductor. subdivisions: 0 for a SpherePrimitive, else an icosphere. Flat normals.
Furnace furnace(FurnaceKind kind, double albedo = 0.5, double alpha = 0.3, uint32_t subdivisions = 0, PictureSize size = {32, 32});
// The same of FurnaceKind::diffuse with albedo 0.5, for a prism of ten sides, 0.028 thick and so long, in a direction along no axis.
Furnace thin_prism(double length, PictureSize size = {32, 32});
// Four balls of glass one behind the other, seen along their axis, under an even sky: radiance 1.
Scene glass_row(PictureSize size = {32, 32});
// A white ball in a ball of glass, which fills the picture, under the same sky.
Scene ball_in_glass(PictureSize size = {32, 32});

enum class PlaneLights { both, point, distant };
struct LitPlane {
    Scene scene;
    PlaneLights lights = PlaneLights::both;
    // Radiance seen at the image point (u, v) in [0, 1]^2, from the top left: grey.
    double radiance(double u, double v) const;
};
// A diffuse plane from straight above, under a point light and a slanting distant one.
LitPlane two_lights_plane(PlaneLights lights = PlaneLights::both, PictureSize size = {32, 32});

// Balls of layered materials that reflect: plastic, a substrate, gloss as of glTF, coats, rough and smooth, over paint and over metal, rough paint.
Scene coated_balls(PictureSize size = {64, 48});
// And of those that let light through: rough and coloured glass, thin sheets, translucent ones, opacity, mixes within mixes.
Scene clear_balls(PictureSize size = {64, 48});
// A ball of one material under an even sky, at most max_depth scattering events.
Scene ball_under_sky(const std::vector<rp_material>& materials, uint32_t material, uint32_t max_depth, PictureSize size = {32, 32});

// Hits -----------------------------------------------------------------------------------------------------------------------

// A height field of 2 n^2 triangles under sun and sky.
Scene terrain_small(uint32_t n = 64, bool smooth_normals = false, PictureSize size = {});
// Boxes, tori, balls of very uneven size and density with overlapping bounds, turned, stretched and mirrored; all materials; several
// area lights of both kinds. A part has 12 to about 1300 triangles.
Scene clutter_small(uint32_t parts = 200, uint64_t seed = 1, PictureSize size = {});
// n triangles of all sizes, slivers among them, some much flatter than float can tell apart.
Scene soup(uint32_t n = 2000, uint64_t seed = 1, PictureSize size = {});
// Fans and grids on small integers and away from them, closed boxes and balls: for rays through edges and vertices.
Scene shared_edges(uint32_t divisions = 8, PictureSize size = {});
// A coloured cloud of points of all sizes over hills, many of them inside of others. among_meshes: and one without colours that mirrors, beside
// hills with shading normals, boxes, tori, a glass ball and a lamp. All radii are such that a point stores them exactly.
Scene cloud_small(uint32_t points = 5000, bool among_meshes = false, uint64_t seed = 1, PictureSize size = {});
// Hills and tori with colours at their vertices, with shading normals and without, beside plain ones, coloured points and a ball of each kind.
Scene painted_small(uint32_t n = 40, PictureSize size = {});
// Clear closed shells inside each other, around diffuse and mirroring ones that cut each other: all bounds overlap. Long paths.
Scene overlapping_shells(uint32_t shells = 12, uint32_t subdivisions = 3, PictureSize size = {});

}  // namespace raypager::reference
