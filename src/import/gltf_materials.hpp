// Materials of a glTF file as those of a scene.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <tuple>

#include "import/gltf_material.hpp"
#include "import/gltf_mesh.hpp"
#include "import/gltf_textures.hpp"

namespace raypager {

// What the mesh is like that has the material.
struct GltfSurfaceUse {
    GltfColors colors;             // of its vertices
    bool green_is_turned = false;  // of normal maps: the coordinates of textures are mirrored there
};

struct GltfSurface {
    uint32_t material = 0;
    std::optional<uint32_t> area_light;
    // Where it shines by an image, times this: no area light yet, and of what is dark there, a material of its own, which may be cut out.
    std::optional<Float3> glow;
    uint32_t dark_material = 0;
    bool invisible = false;      // all of it is cut out
    bool vertex_colors = false;  // are its reflectance
    bool is_lamp = false;        // brighter than white: there to light the scene
};

class GltfMaterials {
public:
    GltfMaterials(Scene& scene, const std::shared_ptr<const GltfModel>& model, GltfNotes& notes)
        : scene_(scene), model_(model), notes_(notes), textures_(model, notes) {}

    // The set of coordinates that its textures use, and whether it has a normal map.
    int64_t uv_set(int64_t number);
    bool has_normal_map(int64_t number);
    GltfSurface surface(int64_t number, const GltfSurfaceUse& use);
    // Of a surface with a glow.
    std::optional<GltfSmallImage> glow_image(int64_t number);
    uint32_t add_light(int64_t number, const Float3& radiance);

private:
    using Optional = std::optional<Texture>;
    // What the parts of a material have in common.
    struct Parts {
        Texture base, metallic, alpha, straight;  // straight: reflected of light that falls on a dielectric straight
    };

    const GltfMaterial& material(int64_t number);
    GltfSurface make_surface(const GltfMaterial& m, const GltfSurfaceUse& use);
    Texture factor_texture(const GltfMaterial& m, const GltfTextureUse& use, GltfChannel channel, bool srgb, const Float3& factor);
    Parts parts_of(const GltfMaterial& m, const GltfSurfaceUse& use);
    uint32_t main_material(const GltfMaterial& m, const Parts& parts, bool green_is_turned);
    uint32_t glossy(const GltfMaterial& m, const Parts& parts, bool green_is_turned);
    uint32_t glass(const GltfMaterial& m, const Parts& parts, bool green_is_turned);
    uint32_t sheet(const GltfMaterial& m, const Parts& parts, const Texture& through, bool green_is_turned);
    uint32_t under_coat(const GltfMaterial& m, const Parts& parts, uint32_t bare, bool green_is_turned);
    uint32_t mixed_by(const GltfMaterial& m, uint32_t first, uint32_t second, const Texture& amount);
    uint32_t cut_out(const GltfMaterial& m, uint32_t material);
    void add_normals(const GltfMaterial& m, bool green_is_turned, TexturedMaterial& to);
    uint32_t add(const GltfMaterial& m, const TexturedMaterial& material);
    uint32_t add_light(const GltfMaterial& m, const Float3& radiance);
    void add_emission(const GltfMaterial& m, GltfSurface& surface);
    void note_what_is_not_read(const GltfMaterial& m);

    Scene& scene_;
    std::shared_ptr<const GltfModel> model_;
    GltfNotes& notes_;
    GltfTextures textures_;
    std::map<int64_t, GltfMaterial> read_;
    std::map<std::tuple<int64_t, bool, bool>, GltfSurface> known_;  // of those whose vertices say nothing
    int64_t uv_set_ = 0;                                            // of the material that is being made
};

}  // namespace raypager
