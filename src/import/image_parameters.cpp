// Textured materials for scenes that are built in memory.
#include "import/textures.hpp"
#include "raypager/materials.hpp"

namespace raypager {

Result<uint32_t> add_material(Scene& scene, const rp_material& material, std::span<const ImageParameter> images) {
    TexturedMaterial textured{material, {}};
    for (const ImageParameter& p : images) {
        rp_texture_map map{};
        map.kind = RP_MAP_UV;
        map.m[0] = p.repeat[0];
        map.m[5] = -p.repeat[1];
        map.m[6] = 1;
        textured.textures.push_back({p.parameter, Texture::image(p.image, texture_op(RP_TEXTURE_IMAGE, p.scale), map)});
    }
    if (!add_material(scene, textured)) {
        scene.materials.pop_back();
        return Status::usage("a material reads more images than a path can keep texels of; give it fewer");
    }
    return static_cast<uint32_t>(scene.materials.size() - 1);
}

void prepare_spheres(Scene& scene) { map_textures_around_spheres(scene); }

}  // namespace raypager
