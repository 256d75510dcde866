// Expressions over images, for what reads formats in Python (raypager/_usd*.py), and for the package's own materials.
#include "raypager/textures.hpp"

#include <nanobind/nanobind.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <cstring>

#include "python/arrays.hpp"
#include "python/bindings.hpp"
#include "python/errors.hpp"
#include "raypager/image_source.hpp"

namespace raypager::python {
namespace {

using Color = std::array<float, 3>;

ImageEncoding encoding_of(const std::string& kind) {
    return {kind == "linear" ? ImageEncoding::Kind::linear : kind == "srgb" ? ImageEncoding::Kind::srgb : ImageEncoding::Kind::automatic, 1};
}

std::shared_ptr<ImageSource> changeable(const std::shared_ptr<const ImageSource>& image) { return std::const_pointer_cast<ImageSource>(image); }

// matrix: two rows, from u, v and 1 to the place on the image, (0, 0) at its top left. channel, wraps: as in abi/texture.h.
Texture texture_of(const std::shared_ptr<ImageSource>& image, const std::array<float, 6>& matrix, const Color& scale, uint32_t channel,
                   const std::array<uint32_t, 2>& wraps) {
    rp_texture_op op = texture_op(RP_TEXTURE_IMAGE, float3(scale));
    op.op |= (channel & RP_TEXTURE_CHANNEL_MASK) << RP_TEXTURE_CHANNEL_SHIFT;
    op.op |= ((wraps[0] & 3u) | (wraps[1] & 3u) << 2) << RP_TEXTURE_WRAP_SHIFT;
    rp_texture_map map{};
    map.kind = RP_MAP_UV;
    for (size_t i = 0; i < 3; ++i) {
        map.m[i] = matrix[i];
        map.m[4 + i] = matrix[3 + i];
    }
    return Texture::image(image, op, map);
}

std::shared_ptr<ImageSource> image_of_bytes(const std::string& name, const std::string& ending, const nanobind::bytes& bytes,
                                            const std::string& kind) {
    const std::shared_ptr<std::byte[]> copy(new std::byte[bytes.size()]);
    std::memcpy(copy.get(), bytes.c_str(), bytes.size());
    return changeable(embedded_image(name, ending, copy, bytes.size(), encoding_of(kind)));
}

// The material's number, and whether its textures are in it: if they are more than a path can keep, their means are.
std::pair<uint32_t, bool> add_textured(Scene& scene, const rp_material& material, const std::vector<std::pair<uint32_t, Texture>>& textures,
                                       const std::optional<Texture>& height) {
    TexturedMaterial textured{material, {}, height};
    for (const auto& [parameter, value] : textures) textured.textures.push_back({parameter, value});
    const bool fits = add_material(scene, textured);
    return {static_cast<uint32_t>(scene.materials.size() - 1), fits};
}

}  // namespace

void add_textures(nb::module_& module) {
    const nb::class_<ImageSource> image(module, "TextureImage");
    nb::class_<Texture>(module, "Texture")
        .def("__init__", [](Texture* self, const Color& value) { new (self) Texture(float3(value)); })
        .def_prop_ro("is_constant", &Texture::is_constant)
        .def_prop_ro("mean",
                     [](const Texture& t) {
                         return Color{t.mean().x, t.mean().y, t.mean().z};
                     })
        .def("__mul__", [](const Texture& a, const Texture& b) { return a * b; });
    module.def("mixed", [](const Texture& a, const Texture& b, const Texture& share_of_b) { return mixed(a, b, share_of_b); });
    module.def("one_minus", [](const Texture& a) { return one_minus(a); });
    module.def("texture_of", &texture_of);
    module.def("texture_bytes", &image_of_bytes);
    module.def("texture_file",
               [](const std::filesystem::path& path, const std::string& kind) { return changeable(image_file_source(path, encoding_of(kind))); });
    module.def(
        "image_shape",
        [](const ImageSource& image) {
            const ImageShape shape = value_of(image.shape());
            return std::array<uint32_t, 4>{shape.width, shape.height, shape.channels, shape.has_alpha ? 1u : 0u};
        },
        "Width, height, channels, and whether one of them is alpha. An error if it cannot be read.");
    module.def("add_textured", &add_textured);
    module.attr("WRAP_REPEAT") = RP_WRAP_REPEAT;
    module.attr("WRAP_BLACK") = RP_WRAP_BLACK;
    module.attr("WRAP_CLAMP") = RP_WRAP_CLAMP;
    module.attr("WRAP_MIRROR") = RP_WRAP_MIRROR;
}

}  // namespace raypager::python
