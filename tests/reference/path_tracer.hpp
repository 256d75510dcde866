// An independent path tracer to compare the renderer with: Embree's traversal, light transport in plain C++ and double precision,
// written to be read. It shares the scene model with the renderer, and nothing else.
#pragma once

#include <cstdint>

#include "raypager/picture.hpp"
#include "raypager/scene.hpp"
#include "reference/geometry.hpp"

namespace raypager::reference {

struct ReferenceSettings {
    uint32_t width = 0, height = 0;  // 0: the scene's
    uint32_t spp = 64;
    uint32_t max_depth = 5;  // scattering events of a path
    uint64_t seed = 1;       // pictures of other seeds are independent estimates
    uint32_t threads = 1;    // the picture does not depend on it
};

// Fails if the geometry cannot be loaded.
Result<Image> trace_reference(const Scene& scene, const ReferenceSettings& settings);
// The same for geometry that is loaded already. REQUIRES: geometry was built from scene.
Image trace_reference(const Scene& scene, const ReferenceGeometry& geometry, const ReferenceSettings& settings);

}  // namespace raypager::reference
