#include "scene/texture_use.hpp"

namespace raypager {
namespace {

// Mixes are within each other to a depth that is checked elsewhere: what is deeper is no mix that a scene may have.
bool any_uses_uvs(const Scene& scene, uint32_t number, uint32_t depth) {
    if (number >= scene.materials.size()) return false;
    const rp_material& material = scene.materials[number];
    if (material.flags >> RP_MATERIAL_PROGRAM_SHIFT != 0 || is_anisotropic(material)) return true;
    if (material.kind != RP_MATERIAL_MIX || depth == RP_MAX_MIXES) return false;
    return any_uses_uvs(scene, material.first, depth + 1) || any_uses_uvs(scene, material.second, depth + 1);
}

}  // namespace

bool is_anisotropic(const rp_material& m) {
    if (m.kind != RP_MATERIAL_CONDUCTOR && m.kind != RP_MATERIAL_LAYERED) return false;
    return RP_ALPHA_ACROSS(m) > 0 || (m.flags & RP_MATERIAL_METAL_BASE && RP_BASE_ALPHA_ACROSS(m) > 0);
}

bool uses_uvs(const Scene& scene, uint32_t material) { return any_uses_uvs(scene, material, 0); }

}  // namespace raypager
