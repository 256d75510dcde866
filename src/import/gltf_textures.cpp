#include "import/gltf_textures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "base/half.hpp"
#include "image/formats.hpp"
#include "raypager/image_source.hpp"

namespace raypager {
namespace {

constexpr ImageEncoding encoding_of(bool srgb) { return {srgb ? ImageEncoding::Kind::srgb : ImageEncoding::Kind::linear, 1}; }

std::optional<rp_texture_map> transform_of(const tinygltf::Value* extension) {
    if (!extension) return std::nullopt;
    std::vector<double> offset = gltf_numbers(extension, "offset"), scale = gltf_numbers(extension, "scale");
    offset.resize(2, 0);
    if (scale.size() != 2) scale = {1, 1};
    // Counter-clockwise as the image is seen, whose v goes downwards; then moved.
    const double angle = gltf_number(extension, "rotation", 0), c = std::cos(angle), s = std::sin(angle);
    rp_texture_map map{};
    map.kind = RP_MAP_UV;
    map.m[0] = static_cast<float>(c * scale[0]);
    map.m[1] = static_cast<float>(s * scale[1]);
    map.m[2] = static_cast<float>(offset[0]);
    map.m[4] = static_cast<float>(-s * scale[0]);
    map.m[5] = static_cast<float>(c * scale[1]);
    map.m[6] = static_cast<float>(offset[1]);
    for (const float value : map.m)
        if (!std::isfinite(value)) return std::nullopt;
    return map;
}

uint32_t wrap_of(int mode) {
    return mode == TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE     ? RP_WRAP_CLAMP
           : mode == TINYGLTF_TEXTURE_WRAP_MIRRORED_REPEAT ? RP_WRAP_MIRROR
                                                           : RP_WRAP_REPEAT;
}

// What the first bytes of a picture say, as the ending of a file: names and types of embedded ones are often wrong.
const char* ending_of(std::span<const std::byte> bytes) {
    const auto begins = [&](std::string_view magic, size_t at = 0) {
        return bytes.size() >= at + magic.size() && std::memcmp(bytes.data() + at, magic.data(), magic.size()) == 0;
    };
    if (begins("\x89PNG")) return ".png";
    if (begins("\xff\xd8")) return ".jpg";
    if (begins("RIFF") && begins("WEBP", 8)) return ".webp";
    if (begins("GIF8")) return ".gif";
    if (begins("BM")) return ".bmp";
    return begins("\xabKTX") ? ".ktx2" : "";
}

// Sums up the texels of an image in the cells of a smaller one.
class SmallImageSum {
public:
    explicit SmallImageSum(const ImageShape& shape) : shape_(shape) {
        constexpr uint32_t most = 256;
        small_.width = std::clamp(shape.width, 1u, most);
        small_.height = std::clamp(shape.height, 1u, most);
        sums_.resize(size_t{small_.width} * small_.height);
    }
    void add(std::span<const std::byte> rows) {
        const size_t value_bytes = bytes_of_channel(shape_.kind), texel_bytes = value_bytes * shape_.channels;
        for (size_t at = 0; at + texel_bytes <= rows.size(); at += texel_bytes, ++count_) {
            const uint64_t x = count_ % shape_.width * small_.width / shape_.width, y = count_ / shape_.width * small_.height / shape_.height;
            if (y >= small_.height) return;
            auto& sum = sums_[static_cast<size_t>(y * small_.width + x)];
            for (size_t c = 0; c < 3; ++c) sum[c] += value(rows.data() + at + (shape_.channels == 4 ? c : 0) * value_bytes);
            ++sum[3];
        }
    }
    GltfSmallImage means() {
        for (const auto& sum : sums_) {
            const double n = std::max(sum[3], 1.0);
            small_.texels.push_back({static_cast<float>(sum[0] / n), static_cast<float>(sum[1] / n), static_cast<float>(sum[2] / n)});
        }
        return std::move(small_);
    }

private:
    double value(const std::byte* at) const {
        if (shape_.kind == TexelKind::unsigned_8) {
            const float share = static_cast<float>(std::to_integer<uint8_t>(*at)) / 255.0f;
            return shape_.srgb ? decode_srgb(share) : share;
        }
        uint16_t bits = 0;
        std::memcpy(&bits, at, sizeof bits);
        return shape_.kind == TexelKind::half ? double{float_of_half(bits)} : bits / 65535.0;
    }
    const ImageShape shape_;
    GltfSmallImage small_;
    std::vector<std::array<double, 4>> sums_;
    uint64_t count_ = 0;
};

uint32_t texel_along(double at, uint32_t size, uint32_t wrap) {
    if (!(std::abs(at) < 1e9)) return 0;
    double share = at - std::floor(at);
    if (wrap == RP_WRAP_CLAMP) share = std::clamp(at, 0.0, 1.0);
    if (wrap == RP_WRAP_MIRROR && std::fmod(std::floor(at), 2) != 0) share = 1 - share;
    return std::min(static_cast<uint32_t>(share * size), size - 1);
}

}  // namespace

GltfTextureUse gltf_texture_use(int64_t texture, int64_t uv_set, const tinygltf::ExtensionMap& extensions) {
    GltfTextureUse use{texture, uv_set, std::nullopt};
    if (const auto* transform = gltf_extension(extensions, "KHR_texture_transform")) {
        use.map = transform_of(transform);
        if (const int64_t other = gltf_index(transform, "texCoord"); other >= 0) use.uv_set = other;
    }
    return use;
}

GltfTextureUse gltf_texture_use(const tinygltf::Value* object, const char* name) {
    const auto* info = gltf_member(object, name);
    if (!info) return {};
    GltfTextureUse use{gltf_index(info, "index"), std::max<int64_t>(gltf_index(info, "texCoord"), 0), std::nullopt};
    if (const auto* transform = gltf_member(gltf_member(info, "extensions"), "KHR_texture_transform")) {
        use.map = transform_of(transform);
        if (const int64_t other = gltf_index(transform, "texCoord"); other >= 0) use.uv_set = other;
    }
    return use;
}

std::shared_ptr<const ImageSource> GltfTextures::image(const GltfTextureUse& use, bool srgb) {
    const std::string place = fmt::format("texture {}", use.texture);
    const auto* texture = gltf_item(model_->content().textures, use.texture);
    int64_t number = texture ? texture->source : -1;
    if (texture)
        if (const auto* webp = gltf_extension(texture->extensions, "EXT_texture_webp")) number = gltf_index(webp, "source");
    const auto [known, added] = images_.try_emplace({number, srgb}, nullptr);
    if (!added) return known->second;
    if (number < 0) {
        notes_.add("no image", place, "has no image of a kind that is read; it is left out");
        return nullptr;
    }
    return known->second = open_image(number, srgb, place);
}

std::shared_ptr<const ImageSource> GltfTextures::open_image(int64_t number, bool srgb, const std::string& place) {
    const auto left_out = [&](const std::string& why) {
        notes_.add("image", place, why + "; the image is left out");
        return nullptr;
    };
    const auto* image = gltf_item(model_->content().images, number);
    if (!image) return left_out(fmt::format("there is no image {}", number));
    std::shared_ptr<const ImageSource> source;
    if (image->bufferView < 0 && image->image.empty()) {
        const auto path = model_->file_of(image->uri);
        if (!path) return left_out(path.status().message());
        source = image_file_source(*path, encoding_of(srgb));
    } else {
        std::span<const std::byte> bytes = std::as_bytes(std::span(image->image));
        if (image->bufferView >= 0) {
            const auto view = model_->view(image->bufferView);
            if (!view) return left_out(view.status().message());
            bytes = *view;
        }
        // The model keeps the bytes.
        source = embedded_image(fmt::format("{} (image {})", model_->name(), number), ending_of(bytes),
                                std::shared_ptr<const std::byte[]>(model_, bytes.data()), bytes.size(), encoding_of(srgb));
    }
    const auto shape = source->shape();
    if (!shape) return left_out(shape.status().message());
    return source;
}

std::optional<Texture> GltfTextures::texture(const GltfTextureUse& use, GltfChannel channel, bool srgb, const Float3& factor) {
    if (!use.is_given()) return std::nullopt;
    const auto source = image(use, srgb);
    if (!source) return std::nullopt;
    const auto* texture = gltf_item(model_->content().textures, use.texture);
    const auto* sampler = texture ? gltf_item(model_->content().samplers, texture->sampler) : nullptr;
    rp_texture_op op = texture_op(RP_TEXTURE_IMAGE, factor);
    if (sampler) op.op |= (wrap_of(sampler->wrapS) | wrap_of(sampler->wrapT) << 2) << RP_TEXTURE_WRAP_SHIFT;
    op.op |= static_cast<uint32_t>(channel) << RP_TEXTURE_CHANNEL_SHIFT;
    return Texture::image(source, op, use.map);
}

std::optional<GltfSmallImage> GltfTextures::small_image(const GltfTextureUse& use) {
    const auto source = image(use, true);
    if (!source) return std::nullopt;
    const auto shape = source->shape();
    if (!shape) return std::nullopt;
    SmallImageSum sum(*shape);
    const Status status = source->read([&](std::span<const std::byte> rows) {
        sum.add(rows);
        return Status();
    });
    if (!status.ok()) {
        notes_.add("image", fmt::format("texture {}", use.texture), status.message());
        return std::nullopt;
    }
    GltfSmallImage result = sum.means();
    const auto* texture = gltf_item(model_->content().textures, use.texture);
    if (const auto* sampler = texture ? gltf_item(model_->content().samplers, texture->sampler) : nullptr) {
        result.wrap_u = wrap_of(sampler->wrapS);
        result.wrap_v = wrap_of(sampler->wrapT);
    }
    result.map = use.map;
    return result;
}

Float3 GltfSmallImage::at(double u, double v) const {
    if (map) {
        const double s = map->m[0] * u + map->m[1] * v + map->m[2];
        v = map->m[4] * u + map->m[5] * v + map->m[6];
        u = s;
    }
    return texels[size_t{texel_along(v, height, wrap_v)} * width + texel_along(u, width, wrap_u)];
}

bool GltfTextures::has_alpha(const GltfTextureUse& use) {
    if (!use.is_given()) return false;
    const auto source = image(use, true);
    const auto shape = source ? source->shape() : Result<ImageShape>(Status::failed(""));
    return shape && shape->has_alpha;
}

}  // namespace raypager
