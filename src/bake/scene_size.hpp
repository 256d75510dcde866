// How large the blocks of a scene will be, about.
#pragma once

#include <cstdint>

#include "raypager/scene.hpp"

namespace raypager {

// From what meshes, clouds and instances say of themselves, before any of it is loaded: those of objects once. The size of blocks follows
// from it, where that is left to the bake, and which objects are baked side by side.
uint64_t estimated_bytes(const Scene& scene);
uint64_t estimated_bytes(const Object& object);

}  // namespace raypager
