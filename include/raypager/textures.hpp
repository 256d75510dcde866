// Textures: expressions over images, of which the programs of materials are made (abi/texture.h).
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "raypager/scene.hpp"

namespace raypager {

// A colour, or a number as a colour of three equal channels, that may vary over a surface.
class Texture {
public:
    Texture(const Float3& value = {0, 0, 0}) : mean_(value) {}
    explicit Texture(double value) : mean_{static_cast<float>(value), static_cast<float>(value), static_cast<float>(value)} {}
    // op: all but image, lookup and map. mean: about what it comes to.
    static Texture operation(const rp_texture_op& op, std::vector<Texture> inputs, std::optional<rp_texture_map> map, const Float3& mean);
    static Texture image(std::shared_ptr<const ImageSource> source, const rp_texture_op& op, std::optional<rp_texture_map> map);

    bool is_constant() const { return !node_; }
    const Float3& mean() const { return mean_; }  // of a constant: it itself
    float mean_number() const { return (mean_.x + mean_.y + mean_.z) / 3; }
    struct Node;
    const Node* node() const { return node_.get(); }

private:
    Float3 mean_;
    std::shared_ptr<const Node> node_;
};

struct Texture::Node {
    rp_texture_op op;
    std::optional<rp_texture_map> map;  // none: by u and v as they are
    std::shared_ptr<const ImageSource> source;
    std::vector<Texture> inputs;
};

Texture operator*(const Texture& a, const Texture& b);
Texture mixed(const Texture& a, const Texture& b, const Texture& share_of_b);
Texture one_minus(const Texture& a);
rp_texture_op texture_op(uint32_t kind, const Float3& a = {1, 1, 1});

// A material, and which of its parameters (RP_PARAMETER_*) are textures.
struct TexturedMaterial {
    struct Parameter {
        uint32_t parameter;
        Texture value;
        float remap = 0;  // as RP_TEXTURE_SET has it
    };
    rp_material material{};
    std::vector<Parameter> textures;

    std::optional<Texture> height = std::nullopt;  // of the surface over itself, in the world: a bump map

    // Colours are clamped to [0, 1]; what is no constant is set by a texture, and `out`, of the material, is its mean.
    void set(uint32_t parameter, const Texture& value, float* out);
};

// Adds a material to a scene, with its program. Returns nothing where that would take more of the stack, or of a path's memory for texels, than there
// is: then the material is there with the means of its textures.
bool add_material(Scene& scene, const TexturedMaterial& material);

}  // namespace raypager
