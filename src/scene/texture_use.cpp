#include "scene/texture_use.hpp"

namespace raypager {
namespace {

// Mixes are within each other to a depth that is checked elsewhere: what is deeper is no mix that a scene may have.
bool has_program(const Scene& scene, uint32_t number, uint32_t depth) {
    if (number >= scene.materials.size()) return false;
    const rp_material& material = scene.materials[number];
    if (material.flags >> RP_MATERIAL_PROGRAM_SHIFT != 0) return true;
    if (material.kind != RP_MATERIAL_MIX || depth == RP_MAX_MIXES) return false;
    return has_program(scene, material.first, depth + 1) || has_program(scene, material.second, depth + 1);
}

}  // namespace

bool has_texture_program(const Scene& scene, uint32_t material) { return has_program(scene, material, 0); }

}  // namespace raypager
