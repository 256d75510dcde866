// How layered materials scatter (raypager/abi/scene.h), in double precision. All directions are local, with z along the shading normal.
#pragma once

#include <optional>

#include "reference/bsdf.hpp"

namespace raypager::reference {

// f times |cos| of the lobes that are spread; from a material's front, or from within it.
Vec3 evaluate_layers(const rp_material& material, bool outside, const Vec3& wo, const Vec3& wi);

struct LayerSample {
    Vec3 wi, weight;  // weight: f |cos| over the density, or of a single direction, over its probability
};
std::optional<LayerSample> sample_layers(const rp_material& material, bool outside, const Vec3& wo, Random& random);

}  // namespace raypager::reference
