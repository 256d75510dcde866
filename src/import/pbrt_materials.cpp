#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "import/materials.hpp"
#include "import/pbrt_reader.hpp"
#include "import/pbrt_spectra.hpp"
#include "import/text.hpp"

namespace raypager {
namespace {

constexpr Float3 mid_grey{0.5f, 0.5f, 0.5f};

float mean(const Float3& c) { return (c.x + c.y + c.z) / 3; }

bool usable(const Float3& c) {
    for (const float x : {c.x, c.y, c.z})
        if (!std::isfinite(x) || x < 0) return false;
    return true;
}

}  // namespace

Status PbrtReader::parameter_color(const PbrtParameter& p, const Float3& fallback, Float3& result) {
    const auto& v = p.numbers;
    const auto f = [&](size_t i) { return static_cast<float>(v[i]); };
    result = fallback;
    if (p.type == "texture" && p.strings.size() == 1) {
        const auto texture = textures_.find(p.strings[0]);
        if (texture == textures_.end()) return parameter_error(p, fmt::format("there is no texture \"{}\"", clipped(p.strings[0])));
        result = texture->second;
    } else if (!p.strings.empty()) {
        const auto named = named_spectrum(p.strings[0]);
        if (named)
            result = *named;
        else
            warn(p.place, fmt::format("the spectrum \"{}\" is not known; a constant is used", clipped(p.strings[0])));
    } else if (p.type == "blackbody" && !v.empty()) {
        if (!(v[0] > 0)) return parameter_error(p, "expected a temperature of more than 0 kelvin");
        warn(p.place, "blackbody spectra are approximated by three colours of luminance 1");
        const float scale = v.size() > 1 ? f(1) : 1;
        const Float3 c = blackbody_color(v[0]);
        result = {scale * c.x, scale * c.y, scale * c.z};
    } else if (p.type == "xyz" && v.size() == 3) {
        result = color_of_xyz({f(0), f(1), f(2)});
    } else if (v.size() == 1) {
        result = {f(0), f(0), f(0)};
    } else if (p.type == "spectrum" && v.size() % 2 == 0 && !v.empty()) {
        warn(p.place, "sampled spectra are approximated by three colours");
        result = sampled_color(v);
    } else if (v.size() == 3) {
        result = {f(0), f(1), f(2)};
    } else {
        return parameter_error(p, "expected one colour");
    }
    return usable(result) ? Status() : parameter_error(p, "expected values that are finite and 0 or more");
}

Status PbrtReader::color(const PbrtParameters& parameters, std::initializer_list<std::string_view> names, const Float3& fallback, Float3& result) {
    result = fallback;
    const PbrtParameter* p = parameters.find(names);
    return p ? parameter_color(*p, fallback, result) : Status();
}

// Roughness as in pbrt-v4: GGX alpha is its square root, unless remaproughness is off. Anisotropy is averaged away.
Status PbrtReader::conductor(const PbrtParameters& parameters, const std::string& prefix, double default_roughness, rp_material& material) {
    const std::string u = prefix + "uroughness", v = prefix + "vroughness", both = prefix + "roughness";
    const auto grey = static_cast<float>(default_roughness);
    Float3 u_roughness, v_roughness;
    RAYPAGER_TRY(color(parameters, {u, both}, {grey, grey, grey}, u_roughness));
    RAYPAGER_TRY(color(parameters, {v, both}, {grey, grey, grey}, v_roughness));
    if (parameters.find(u) || parameters.find(v))
        warn(parameters.find({u, v})->place, "anisotropic roughness is not supported; the mean of both directions is used");
    const bool remap = parameters.boolean("remaproughness", true);
    const float roughness = std::clamp((mean(u_roughness) + mean(v_roughness)) / 2, 0.0f, 1.0f);
    const float alpha = remap ? std::sqrt(roughness) : roughness;
    constexpr float smooth = 1e-3f;  // what pbrt-v4 takes for a mirror

    const std::string reflectance = prefix + "reflectance";
    if (parameters.find(reflectance)) {
        Float3 value;
        RAYPAGER_TRY(color(parameters, {reflectance}, {1, 1, 1}, value));
        material = conductor_of_reflectance(value, alpha < smooth ? 0 : alpha);
        return parameters.status();
    }
    Float3 eta, k;
    RAYPAGER_TRY(color(parameters, {prefix + "eta"}, *named_spectrum("metal-Cu-eta"), eta));
    RAYPAGER_TRY(color(parameters, {prefix + "k"}, *named_spectrum("metal-Cu-k"), k));
    material = conductor_material(eta, k, alpha < smooth ? 0 : alpha);
    return parameters.status();
}

Status PbrtReader::dielectric(const Directive& directive, const PbrtParameters& parameters, rp_material& material) {
    Float3 eta;
    RAYPAGER_TRY(color(parameters, {"eta", "index"}, {1.5f, 1.5f, 1.5f}, eta));
    if (!(mean(eta) > 0)) return error(directive, "the index of refraction must be more than 0");
    if (eta.x != eta.y || eta.y != eta.z) warn(directive.place, "dispersion is not supported; the mean index of refraction is used");
    Float3 u_roughness, v_roughness;
    RAYPAGER_TRY(color(parameters, {"uroughness", "roughness"}, {}, u_roughness));
    RAYPAGER_TRY(color(parameters, {"vroughness", "roughness"}, {}, v_roughness));
    if (mean(u_roughness) > 0 || mean(v_roughness) > 0) warn(directive.place, "rough dielectrics are not supported; the surface is smooth");
    warn_if_present(parameters, {"Kr", "Kt"}, "glass reflects and transmits all light");
    material = dielectric_material(mean(eta));
    return {};
}

Status PbrtReader::make_material(const Directive& directive, const std::string& type, const PbrtParameters& parameters, uint32_t& index) {
    warn_if_present(parameters, {"displacement", "normalmap", "bumpmap"}, "the surface stays as it is");
    rp_material material{};
    if (type.empty() || type == "none" || type == "interface") {
        index = no_surface;
        return {};
    }
    Float3 reflectance;
    if (type == "diffuse" || type == "matte") {
        RAYPAGER_TRY(color(parameters, {"reflectance", "Kd"}, mid_grey, reflectance));
        if (parameters.number("sigma", 0) > 0) warn(directive.place, "rough diffuse surfaces are not supported; sigma is taken as 0");
        material = diffuse_material(reflectance);
    } else if (type == "conductor" || type == "metal") {
        RAYPAGER_TRY(conductor(parameters, "", type == "metal" ? 0.01 : 0.0, material));
    } else if (type == "mirror") {
        RAYPAGER_TRY(color(parameters, {"reflectance", "Kr"}, {0.9f, 0.9f, 0.9f}, reflectance));
        material = conductor_of_reflectance(reflectance, 0);
    } else if (type == "dielectric" || type == "glass") {
        RAYPAGER_TRY(dielectric(directive, parameters, material));
    } else if (type == "thindielectric") {
        warn(directive.place, "Material \"thindielectric\" is not supported; a solid dielectric is used");
        RAYPAGER_TRY(dielectric(directive, parameters, material));
    } else if (type == "coatedconductor") {
        warn(directive.place, "Material \"coatedconductor\" is not supported; the conductor is used without its coat");
        const bool bare = parameters.find("reflectance") != nullptr;
        RAYPAGER_TRY(conductor(parameters, bare ? "" : "conductor.", 0.0, material));
    } else {
        RAYPAGER_TRY(color(parameters, {"reflectance", "Kd", "color", "Kr"}, mid_grey, reflectance));
        warn(directive.place, fmt::format("Material \"{}\" is not supported; a diffuse one of its colour is used", clipped(type)));
        material = diffuse_material(reflectance);
    }
    for (size_t i = 0; i < 3; ++i)
        if (material.kind == RP_MATERIAL_CONDUCTOR && material.eta[i] == 0 && material.k[i] == 0)
            return error(directive, "eta and k must not both be 0");
    index = static_cast<uint32_t>(scene_.materials.size());
    scene_.materials.push_back(material);
    return parameters.status();
}

Status PbrtReader::material(const Directive& directive) {
    std::string type;
    PbrtParameters parameters;
    RAYPAGER_TRY(take_type_and_parameters(type, parameters));
    return make_material(directive, type, parameters, state_.material);
}

Status PbrtReader::make_named_material(const Directive& directive) {
    std::string name;
    PbrtParameters parameters;
    RAYPAGER_TRY(take_type_and_parameters(name, parameters));
    const std::string type = parameters.text("type", "");
    RAYPAGER_TRY(parameters.status());
    if (!parameters.find("type")) return error(directive, fmt::format("expected \"string type\" among the parameters of \"{}\"", clipped(name)));
    uint32_t index = 0;
    RAYPAGER_TRY(make_material(directive, type, parameters, index));
    named_materials_[name] = index;
    return {};
}

Status PbrtReader::named_material(const Directive& directive) {
    std::string name;
    RAYPAGER_TRY(take_string(name));
    const auto found = named_materials_.find(name);
    if (found == named_materials_.end())
        return error(directive, fmt::format("there is no material \"{}\"; define it first with MakeNamedMaterial", clipped(name)));
    state_.material = found->second;
    return {};
}

// A texture is replaced by one colour: that of a constant, the middle of a pattern's two, or grey.
Status PbrtReader::texture(const Directive& directive) {
    std::string name, value_type, type;
    PbrtParameters parameters;
    RAYPAGER_TRY(take_string(name));
    RAYPAGER_TRY(take_string(value_type));
    RAYPAGER_TRY(take_type_and_parameters(type, parameters));
    Float3 value = mid_grey;
    if (type == "constant") {
        RAYPAGER_TRY(color(parameters, {"value"}, {1, 1, 1}, value));
    } else if (type == "scale") {
        Float3 a, b;
        RAYPAGER_TRY(color(parameters, {"tex", "tex1"}, {1, 1, 1}, a));
        RAYPAGER_TRY(color(parameters, {"scale", "tex2"}, {1, 1, 1}, b));
        value = {a.x * b.x, a.y * b.y, a.z * b.z};
    } else if (parameters.find({"tex1", "tex2"})) {
        Float3 a, b;
        RAYPAGER_TRY(color(parameters, {"tex1"}, {1, 1, 1}, a));
        RAYPAGER_TRY(color(parameters, {"tex2"}, {0, 0, 0}, b));
        value = {(a.x + b.x) / 2, (a.y + b.y) / 2, (a.z + b.z) / 2};
    }
    if (type != "constant" && type != "scale")
        warn(directive.place, fmt::format("Texture \"{}\" is not supported; one mid colour is used", clipped(type)));
    if (!usable(value)) return error(directive, "its value is not finite");
    textures_[name] = value;
    return {};
}

}  // namespace raypager
