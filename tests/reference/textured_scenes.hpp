// Scenes with textures, for tests.
#pragma once

#include "raypager/scene.hpp"
#include "reference/scenes.hpp"

namespace raypager::reference {

// Images whose texels are larger than what a pixel sees of them, on all kinds of materials and maps; with_cutouts: leaves with holes between them and
// the lamp, one within another, and brushed metal.
Scene textured_room(bool with_cutouts, PictureSize size = {});
// Hills of 2 n^2 triangles under images of several pages, with their levels: of bytes, of halves and of grey.
Scene textured_hills(uint32_t n, PictureSize size = {});
// Brushed metals, coats and glass on meshes with u and v and without, on spheres about several axes; no textures. A torus has 2 n^2 triangles.
Scene brushed_small(uint32_t n, PictureSize size = {});
// A hedge of n x n leaves, which are squares of which an image cuts the shapes, before a wall. decals: also a sheet under the lamp, and
// another with holes right before it, closer than rays that pass the one begin behind it.
Scene hedge(uint32_t n, PictureSize size = {}, bool decals = false);
// A hedge of instances of a few twigs, whose leaves an image cuts out, on a floor under an image, beside brushed rings that are instances, too.
Scene instanced_hedge(uint32_t instances, PictureSize size = {});
// Such a hedge whose instances have other materials than their objects: opaque ones with holes and images, cut ones whole. tinted: and colours.
Scene overridden_hedge(uint32_t instances, PictureSize size = {}, bool tinted = true);

}  // namespace raypager::reference
