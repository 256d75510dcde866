// Textures of a glTF file: their images, how these are repeated, and by which coordinates.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "import/gltf_model.hpp"
#include "import/gltf_notes.hpp"
#include "import/textures.hpp"
#include "raypager/scene.hpp"

namespace raypager {

// Where a material names a texture.
struct GltfTextureUse {
    int64_t texture = -1;  // -1: it names none
    int64_t uv_set = 0;
    std::optional<rp_texture_map> map;  // KHR_texture_transform
    bool is_given() const { return texture >= 0; }
};
GltfTextureUse gltf_texture_use(int64_t texture, int64_t uv_set, const tinygltf::ExtensionMap& extensions);
// In an extension.
GltfTextureUse gltf_texture_use(const tinygltf::Value* object, const char* name);

// At most 256 texels along each side, linear.
struct GltfSmallImage {
    uint32_t width = 1, height = 1, wrap_u = RP_WRAP_REPEAT, wrap_v = RP_WRAP_REPEAT;
    std::vector<Float3> texels;
    std::optional<rp_texture_map> map;
    Float3 at(double u, double v) const;  // coordinates of a surface
};

enum class GltfChannel : uint32_t { color = 0, red = 3, green = 4, blue = 5, alpha = 6 };

class GltfTextures {
public:
    GltfTextures(std::shared_ptr<const GltfModel> model, GltfNotes& notes) : model_(std::move(model)), notes_(notes) {}

    // What the texture says times factor, or nothing if it cannot be had; then a note says why. srgb: how colours are stored in it.
    std::optional<Texture> texture(const GltfTextureUse& use, GltfChannel channel, bool srgb, const Float3& factor);
    // Colours of the texture, for looking at it while the scene is read.
    std::optional<GltfSmallImage> small_image(const GltfTextureUse& use);
    // Whether its alpha says anything.
    bool has_alpha(const GltfTextureUse& use);

private:
    std::shared_ptr<const ImageSource> image(const GltfTextureUse& use, bool srgb);
    std::shared_ptr<const ImageSource> open_image(int64_t number, bool srgb, const std::string& place);

    std::shared_ptr<const GltfModel> model_;
    GltfNotes& notes_;
    std::map<std::pair<int64_t, bool>, std::shared_ptr<const ImageSource>> images_;  // null: it cannot be had
};

}  // namespace raypager
