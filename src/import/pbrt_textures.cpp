#include "import/pbrt_textures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "import/pbrt_reader.hpp"
#include "import/text.hpp"
#include "raypager/image_source.hpp"

namespace raypager {
namespace {

bool all_finite(const Float3& c) { return std::isfinite(c.x) && std::isfinite(c.y) && std::isfinite(c.z); }

Float3 middle(const Texture& a, const Texture& b) { return mixed(a, b, Texture(0.5)).mean(); }

std::optional<uint32_t> wrap_mode(const std::string& name) {
    if (name == "repeat") return RP_WRAP_REPEAT;
    if (name == "black") return RP_WRAP_BLACK;
    if (name == "clamp") return RP_WRAP_CLAMP;
    return std::nullopt;
}

const PbrtParameter* texture_among(const PbrtParameters& parameters, std::initializer_list<std::string_view> names) {
    const PbrtParameter* p = parameters.find(names);
    return p && p->type == "texture" && p->strings.size() == 1 ? p : nullptr;
}

void set_matrix(const Transform& t, rp_texture_map& map) {
    for (size_t row = 0; row < 3; ++row)
        for (size_t column = 0; column < 4; ++column) map.m[4 * row + column] = static_cast<float>(t.m[row][column]);
}

}  // namespace

// Points of the world in the space in which the texture was said.
Transform PbrtReader::to_texture_space(const Directive& directive) {
    const auto inverse = state_.transform.inverse();
    if (!inverse) warn(directive.location, "the transform of a texture cannot be inverted; it is as if there were none");
    return inverse.value_or(Transform());
}

// Of textures in space. pbrt-v3 takes the transform the wrong way round, and scenes were made for how that looks.
rp_texture_map PbrtReader::point_map(const Directive& directive) {
    rp_texture_map map{};
    map.kind = RP_MAP_POINT;
    set_matrix(version_ == 3 ? state_.transform : to_texture_space(directive), map);
    return map;
}

// s and t. flipped: for images, whose rows come from the top.
Status PbrtReader::surface_map(const Directive& directive, const PbrtParameters& parameters, bool flipped, std::optional<rp_texture_map>& map) {
    const std::string kind = parameters.text("mapping", "uv");
    const auto number = [&](const char* name, double usual) { return static_cast<float>(parameters.number(name, usual)); };
    rp_texture_map m{};
    m.scale[0] = m.scale[1] = 1;
    if (kind == "spherical" || kind == "cylindrical") {
        m.kind = kind == "spherical" ? RP_MAP_SPHERE : RP_MAP_CYLINDER;
        set_matrix(to_texture_space(directive), m);
    } else if (kind == "planar") {
        m.kind = RP_MAP_POINT;
        const Transform to_texture = version_ == 3 ? Transform() : to_texture_space(directive);
        const std::array<double, 3> axes[2] = {parameters.point("v1", {1, 0, 0}), parameters.point("v2", {0, 1, 0})};
        const float offset[2] = {number("udelta", 0), number("vdelta", 0)};
        for (size_t row = 0; row < 2; ++row)
            for (size_t column = 0; column < 4; ++column) {
                double sum = column == 3 ? double{offset[row]} : 0;
                for (size_t k = 0; k < 3; ++k) sum += axes[row][k] * to_texture.m[k][column];
                m.m[4 * row + column] = static_cast<float>(sum);
            }
    } else {
        if (kind != "uv") warn(directive.location, fmt::format("mapping \"{}\" of a texture is not known; u and v are used", clipped(kind)));
        m.kind = RP_MAP_UV;
        m.m[0] = number("uscale", 1);
        m.m[2] = number("udelta", 0);
        m.m[5] = number("vscale", 1);
        m.m[6] = number("vdelta", 0);
    }
    if (flipped && m.kind >= RP_MAP_SPHERE) {
        m.scale[1] = -m.scale[1];
        m.offset[1] = 1 - m.offset[1];
    } else if (flipped) {
        for (size_t k = 4; k < 8; ++k) m.m[k] = -m.m[k];
        m.m[m.kind == RP_MAP_UV ? 6 : 7] += 1;
    }
    for (const float x : m.m)
        if (!std::isfinite(x)) return error(directive, "the mapping of the texture is not finite");
    map = m;
    return parameters.status();
}

Status PbrtReader::image_encoding(const Directive& directive, const PbrtParameters& parameters, ImageEncoding& encoding) {
    const std::string name = parameters.text("encoding", "");
    if (parameters.find("gamma")) {  // of version 3: true or false
        seems_version(3);
        encoding.kind = parameters.boolean("gamma", true) ? ImageEncoding::Kind::srgb : ImageEncoding::Kind::linear;
    } else if (name == "sRGB" || name == "srgb") {
        encoding.kind = ImageEncoding::Kind::srgb;
    } else if (name == "linear") {
        encoding.kind = ImageEncoding::Kind::linear;
    } else if (name.starts_with("gamma ")) {
        const auto value = parse_number(std::string_view(name).substr(6));
        if (!value || !(*value > 0 && *value <= 100)) return error(directive, "expected \"gamma\" and a number more than 0 as encoding");
        encoding = {ImageEncoding::Kind::gamma, static_cast<float>(*value)};
    } else if (!name.empty()) {
        warn(directive.location, fmt::format("encoding \"{}\" of an image is not known; what the file says counts", clipped(name)));
    }
    return parameters.status();
}

Status PbrtReader::image_source(const Directive& directive, const PbrtParameter& file, const ImageEncoding& encoding,
                                std::shared_ptr<const ImageSource>& source) {
    if (file.strings.size() != 1) return parameter_error(file, "expected one file name");
    std::filesystem::path path;
    bool exists = false;
    if (const Status found = find_file(file.strings[0], path, exists); !found.ok()) return parameter_error(file, found.message());
    if (!exists) return parameter_error(file, fmt::format("there is no file {}", clipped(path.string())));
    auto& known = image_sources_[{path.lexically_normal(), static_cast<int>(encoding.kind), encoding.gamma}];
    if (!known) {
        known = image_file_source(path, encoding);
        if (const auto shape = known->shape(); !shape) return error(directive, shape.status().message());
        if (listed_files_.insert(path.string()).second) scene_.files.push_back(path.string());
    }
    source = known;
    return {};
}

Status PbrtReader::image_texture(const Directive& directive, const PbrtParameters& parameters, bool is_float, PbrtTexture& made) {
    std::shared_ptr<const ImageSource> source;
    const PbrtParameter* file = parameters.find("filename");
    if (!file) return error(directive, "expected \"string filename\" of the image");
    ImageEncoding encoding;
    RAYPAGER_TRY(image_encoding(directive, parameters, encoding));
    made.fault = image_source(directive, *file, encoding, source);
    std::optional<rp_texture_map> map;
    RAYPAGER_TRY(surface_map(directive, parameters, true, map));
    const auto scale = static_cast<float>(parameters.number("scale", 1));
    rp_texture_op op = texture_op(RP_TEXTURE_IMAGE, {scale, scale, scale});
    // The luminance counts in version 3, the mean in version 4.
    if (is_float) op.op |= (version_ == 3 ? 2u : 1u) << RP_TEXTURE_CHANNEL_SHIFT;
    if (parameters.boolean("invert", false)) op.op |= RP_TEXTURE_INVERT;
    const std::string wrap_name = parameters.text("wrap", "repeat");
    const auto wrap = wrap_mode(wrap_name);
    if (!wrap) warn(directive.location, fmt::format("wrap \"{}\" of an image is not known; it repeats", clipped(wrap_name)));
    op.op |= (wrap.value_or(RP_WRAP_REPEAT) | wrap.value_or(RP_WRAP_REPEAT) << 2) << RP_TEXTURE_WRAP_SHIFT;
    for (const std::string_view unused : {"filter", "trilinear", "maxanisotropy"}) parameters.find(unused);
    if (made.fault.ok()) made.value = Texture::image(std::move(source), op, map);
    return parameters.status();
}

// Of noise.
Status PbrtReader::noise_texture(const Directive& directive, const std::string& type, const PbrtParameters& parameters, Texture& texture) {
    const auto octaves = static_cast<float>(std::clamp(parameters.number("octaves", 8), 0.0, 32.0));
    const auto roughness = static_cast<float>(parameters.number("roughness", 0.5));
    rp_texture_op op = texture_op(type == "fbm" ? RP_TEXTURE_FBM : type == "wrinkled" ? RP_TEXTURE_WRINKLED : RP_TEXTURE_WINDY);
    op.a[0] = octaves;
    op.a[1] = roughness;
    Float3 mean = {0.3f, 0.3f, 0.3f};
    if (type == "marble") {
        op = texture_op(RP_TEXTURE_MARBLE, {octaves, roughness, static_cast<float>(parameters.number("scale", 1))});
        op.b[0] = static_cast<float>(parameters.number("variation", 0.2));
        mean = {0.8f, 0.8f, 0.8f};
    }
    texture = Texture::operation(op, {}, point_map(directive), mean);
    return parameters.status();
}

// A texture of others, or an image. is_float: of numbers, which may be negative: bumps, say, are.
Status PbrtReader::make_texture(const Directive& directive, const std::string& type, const PbrtParameters& parameters, bool is_float,
                                PbrtTexture& made) {
    Status status;
    // Whether the part is an image that cannot be read.
    const auto missing = [&](std::initializer_list<std::string_view> names, const std::map<std::string, PbrtTexture, std::less<>>& textures) {
        const PbrtParameter* p = texture_among(parameters, names);
        const auto found = p ? textures.find(p->strings[0]) : textures.end();
        if (found == textures.end() || found->second.fault.ok()) return false;
        made.fault = found->second.fault;
        return true;
    };
    const auto part = [&](std::initializer_list<std::string_view> names, double usual) {
        Texture t{usual};
        if (missing(names, is_float ? textures_.floats : textures_.spectra)) return t;
        if (const Status read = is_float ? number_texture(parameters, names, usual, t) : color_texture(parameters, names, Texture(usual).mean(), t);
            !read.ok() && status.ok())
            status = read;
        return t;
    };
    const auto number_part = [&](std::initializer_list<std::string_view> names, double usual) {
        Texture t{usual};
        if (missing(names, textures_.floats)) return t;
        if (const Status read = number_texture(parameters, names, usual, t); !read.ok() && status.ok()) status = read;
        return t;
    };
    Texture& value = made.value;
    std::optional<rp_texture_map> map;
    if (type == "constant") {
        value = part({"value"}, 1);
    } else if (type == "scale") {
        value = part({"tex", "tex1"}, 1) * part({"tex2"}, 1) * number_part({"scale"}, 1);
    } else if (type == "mix") {
        const Texture a = part({"tex1"}, 0), b = part({"tex2"}, 1);
        value = mixed(a, b, number_part({"amount"}, 0.5));
    } else if (type == "directionmix") {
        const Texture a = part({"tex1"}, 0), b = part({"tex2"}, 1);
        std::array<double, 3> d = parameters.point("dir", {0, 1, 0});
        d = state_.transform.vector(d[0], d[1], d[2]);
        const double length = std::hypot(d[0], d[1], d[2]);
        if (!(length > 0) || !std::isfinite(length)) return error(directive, "the direction of the texture is no direction");
        const auto unit = [&](size_t i) { return static_cast<float>(d[i] / length); };
        value = Texture::operation(texture_op(RP_TEXTURE_DIRECTION, {unit(0), unit(1), unit(2)}), {a, b}, std::nullopt, middle(a, b));
    } else if (type == "checkerboard") {
        const Texture a = part({"tex1"}, 1), b = part({"tex2"}, 0);
        rp_texture_op op = texture_op(RP_TEXTURE_CHECKS);
        if (parameters.count("dimension", 2, 3) == 3) {
            op.op |= RP_TEXTURE_SOLID;
            map = point_map(directive);
        } else {
            RAYPAGER_TRY(surface_map(directive, parameters, false, map));
        }
        parameters.find("aamode");
        value = Texture::operation(op, {a, b}, map, middle(a, b));
    } else if (type == "dots") {
        const Texture inside = part({"inside"}, 1), outside = part({"outside"}, 0);
        RAYPAGER_TRY(surface_map(directive, parameters, false, map));
        value = Texture::operation(texture_op(RP_TEXTURE_DOTS), {inside, outside}, map, mixed(inside, outside, Texture(0.8)).mean());
    } else if (type == "bilerp") {
        std::vector<Texture> corners = {part({"v00"}, 0), part({"v01"}, 1), part({"v10"}, 0), part({"v11"}, 1)};
        RAYPAGER_TRY(surface_map(directive, parameters, false, map));
        const Float3 mean = mixed(middle(corners[0], corners[1]), middle(corners[2], corners[3]), Texture(0.5)).mean();
        value = Texture::operation(texture_op(RP_TEXTURE_BILERP), std::move(corners), map, mean);
    } else if (type == "imagemap") {
        RAYPAGER_TRY(image_texture(directive, parameters, is_float, made));
    } else if (type == "ptex") {
        RAYPAGER_TRY(ptex_texture(directive, parameters, is_float, made));
    } else if (type == "fbm" || type == "wrinkled" || type == "windy" || type == "marble") {
        RAYPAGER_TRY(noise_texture(directive, type, parameters, value));
    } else if (type == "uv") {
        RAYPAGER_TRY(surface_map(directive, parameters, false, map));
        value = Texture::operation(texture_op(RP_TEXTURE_UV), {}, map, {0.5f, 0.5f, 0});
    } else {
        made.approximated = true;
        value = Texture(0.5);
    }
    RAYPAGER_TRY(status);
    return parameters.status();
}

Status PbrtReader::texture(const Directive& directive) {
    std::string name, value_type, type;
    PbrtParameters parameters = no_parameters();
    RAYPAGER_TRY(take_string(name));
    RAYPAGER_TRY(take_string(value_type));
    RAYPAGER_TRY(take_type_and_parameters(type, parameters));
    const bool is_float = value_type == "float";
    if (!is_float && value_type != "spectrum" && value_type != "color" && value_type != "rgb") {
        warn(directive.location, fmt::format("Texture \"{}\" is of type \"{}\", which is neither float nor spectrum; it is left out", clipped(name),
                                             clipped(value_type)));
        return {};
    }
    if (value_type == "color") seems_version(3);
    PbrtTexture made;
    made.type = type;
    made.location = directive.location;
    RAYPAGER_TRY(make_texture(directive, type, parameters, is_float, made));
    if (!all_finite(made.value.mean())) return error(directive, "its value is not finite");
    warn_of_unused(directive, type, parameters, {"type", "name"});
    (is_float ? textures_.floats : textures_.spectra)[name] = made;
    return {};
}

Status PbrtReader::color_texture(const PbrtParameters& parameters, std::initializer_list<std::string_view> names, const Float3& fallback,
                                 Texture& result) {
    const PbrtParameter* p = texture_among(parameters, names);
    const auto found = p ? textures_.spectra.find(p->strings[0]) : textures_.spectra.end();
    if (found != textures_.spectra.end() && !found->second.fault.ok()) return found->second.fault;
    if (found != textures_.spectra.end() && !found->second.approximated) {
        result = found->second.value;
        return {};
    }
    Float3 constant;
    RAYPAGER_TRY(color(parameters, names, fallback, constant));
    result = constant;
    return {};
}

Status PbrtReader::number_texture(const PbrtParameters& parameters, std::initializer_list<std::string_view> names, double fallback, Texture& result) {
    const PbrtParameter* p = texture_among(parameters, names);
    const auto found = p ? textures_.floats.find(p->strings[0]) : textures_.floats.end();
    if (found != textures_.floats.end() && !found->second.fault.ok()) return found->second.fault;
    if (found != textures_.floats.end() && !found->second.approximated) {
        result = found->second.value;
        return {};
    }
    result = Texture(parameters.number(names, fallback));
    return parameters.status();
}

}  // namespace raypager
