#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "import/pbrt_reader.hpp"
#include "import/pbrt_spectra.hpp"
#include "import/text.hpp"
#include "raypager/materials.hpp"
#include "scene/check_material.hpp"

namespace raypager {
namespace {

constexpr Float3 mid_grey{0.5f, 0.5f, 0.5f}, quarter_grey{0.25f, 0.25f, 0.25f}, white_surface{1, 1, 1};

float mean(const Float3& c) { return (c.x + c.y + c.z) / 3; }

Float3 times(const Float3& c, double factor) {
    const auto f = static_cast<float>(factor);
    return {c.x * f, c.y * f, c.z * f};
}

Float3 product(const Float3& a, const Float3& b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }

void store_unit(const Float3& from, float* to) {
    to[0] = std::clamp(from.x, 0.0f, 1.0f);
    to[1] = std::clamp(from.y, 0.0f, 1.0f);
    to[2] = std::clamp(from.z, 0.0f, 1.0f);
}

// Materials that only one version has. Both have mix, hair and subsurface.
constexpr std::array version_3_materials = {"matte",       "metal",   "mirror", "glass",        "plastic",  "uber",
                                            "translucent", "fourier", "disney", "kdsubsurface", "substrate"};
constexpr std::array version_4_materials = {"diffuse",       "conductor",       "dielectric",          "thindielectric",
                                            "coateddiffuse", "coatedconductor", "diffusetransmission", "measured"};

// GGX alpha of a roughness: pbrt-v4's square root, or the polynomial of pbrt-v3 (its TrowbridgeReitzDistribution).
double alpha_of_roughness(double roughness, bool version_3) {
    if (!version_3) return std::sqrt(std::max(roughness, 0.0));
    const double x = std::log(std::max(roughness, 1e-3));
    return 1.62142 + x * (0.819955 + x * (0.1734 + x * (0.0171201 + x * 0.000640711)));
}

}  // namespace

// Anisotropy is averaged away. usual: where no roughness is given.
Status PbrtReader::roughness(const PbrtParameters& parameters, const std::string& prefix, bool version_3, double usual, float& alpha) {
    const std::string u = prefix + "uroughness", v = prefix + "vroughness", both = prefix + "roughness";
    const double u_roughness = parameters.number({u, both}, usual), v_roughness = parameters.number({v, both}, usual);
    const bool remap = parameters.boolean("remaproughness", true);
    RAYPAGER_TRY(parameters.status());
    if (u_roughness != v_roughness)
        warn(parameters.find({u, v})->location, "anisotropic roughness is not supported; the mean of both directions is used");
    double roughness = (u_roughness + v_roughness) / 2;
    // Glass of version 3 is smooth where it says so, whatever its polynomial makes of that.
    if (remap && !(roughness == 0 && usual == 0)) roughness = alpha_of_roughness(roughness, version_3);
    constexpr double smooth = 1e-3;  // what pbrt-v4 takes for a mirror
    alpha = static_cast<float>(roughness < smooth ? 0 : std::min(roughness, 1.0));
    return {};
}

Status PbrtReader::conductor(const PbrtParameters& parameters, const std::string& prefix, bool version_3, rp_material& material) {
    float alpha = 0;
    RAYPAGER_TRY(roughness(parameters, prefix, version_3, version_3 ? 0.01 : 0, alpha));
    const std::string reflectance = prefix + "reflectance";
    if (parameters.find(reflectance)) {
        Float3 value;
        RAYPAGER_TRY(color(parameters, {reflectance}, white_surface, value));
        material = conductor_of_reflectance(value, alpha);
        return parameters.status();
    }
    Float3 eta, k;
    RAYPAGER_TRY(color(parameters, {prefix + "eta"}, *named_spectrum("metal-Cu-eta"), eta));
    RAYPAGER_TRY(color(parameters, {prefix + "k"}, *named_spectrum("metal-Cu-k"), k));
    material = conductor_material(eta, k, alpha);
    return parameters.status();
}

Status PbrtReader::index_of_refraction(const Directive& directive, const PbrtParameters& parameters, const std::string& prefix, float& ior) {
    const std::string eta_name = prefix + "eta", index_name = prefix + "index";
    const PbrtParameter* index = parameters.find({eta_name, index_name});
    Float3 eta{1.5f, 1.5f, 1.5f};
    if (index && index->type == "texture")
        eta = times(white_surface, parameters.number(index->name, 1.5));
    else
        RAYPAGER_TRY(color(parameters, {eta_name, index_name}, eta, eta));
    RAYPAGER_TRY(parameters.status());
    if (!(mean(eta) > 0)) return error(directive, "the index of refraction must be more than 0");
    if (eta.x != eta.y || eta.y != eta.z) warn(directive.location, "dispersion is not supported; the mean index of refraction is used");
    ior = mean(eta);
    return {};
}

Status PbrtReader::dielectric(const Directive& directive, const PbrtParameters& parameters, bool version_3, rp_material& material) {
    float ior = 1.5f, alpha = 0;
    Float3 reflected, refracted;
    RAYPAGER_TRY(index_of_refraction(directive, parameters, "", ior));
    RAYPAGER_TRY(roughness(parameters, "", version_3, 0, alpha));
    RAYPAGER_TRY(color(parameters, {"Kr"}, white_surface, reflected));
    RAYPAGER_TRY(color(parameters, {"Kt"}, white_surface, refracted));
    material = dielectric_material(ior, alpha, reflected, refracted);
    return parameters.status();
}

// A mix with what lets everything through. opacity: 0 to 1 by channel; of a coloured one the mean counts.
void PbrtReader::make_translucent(const Directive& directive, const Float3& opacity, rp_material& material) {
    if (opacity.x >= 1 && opacity.y >= 1 && opacity.z >= 1) return;
    if (opacity.x != opacity.y || opacity.y != opacity.z) warn(directive.location, "coloured opacity is not supported; its mean is used");
    const auto first = static_cast<uint32_t>(scene_.materials.size());
    scene_.materials.push_back(clear_material());
    scene_.materials.push_back(material);
    material = mix_material(first, first + 1, mean(opacity));
}

// The materials of version 3 that add gloss to a diffuse base.
Status PbrtReader::glossy(const Directive& directive, const std::string& type, const PbrtParameters& parameters, rp_material& material) {
    const bool substrate = type == "substrate";
    Float3 diffuse, specular, black{0, 0, 0}, reflected = black, refracted = black, opacity = white_surface;
    float alpha = 0, ior = 1.5f;
    RAYPAGER_TRY(color(parameters, {"Kd"}, substrate ? mid_grey : quarter_grey, diffuse));
    RAYPAGER_TRY(color(parameters, {"Ks"}, substrate ? mid_grey : quarter_grey, specular));
    RAYPAGER_TRY(roughness(parameters, "", true, 0.1, alpha));
    material = rp_material{};
    material.kind = RP_MATERIAL_LAYERED;
    material.alpha = std::max(alpha, 1e-3f);
    if (type == "plastic") {
        material.ior = 1.5f;
    } else if (substrate) {
        material.ior = 1.5f;
        material.flags = RP_MATERIAL_BLEND;
    } else if (type == "translucent") {
        Float3 share, through;
        RAYPAGER_TRY(color(parameters, {"reflect"}, mid_grey, share));
        RAYPAGER_TRY(color(parameters, {"transmit"}, mid_grey, through));
        material.ior = ior;
        material.flags = RP_MATERIAL_SOLID;
        store_unit(product(diffuse, through), material.transmittance);
        store_unit(product(specular, through), material.refracted);
        diffuse = product(diffuse, share);
        specular = product(specular, share);
    } else {
        RAYPAGER_TRY(index_of_refraction(directive, parameters, "", ior));
        RAYPAGER_TRY(color(parameters, {"Kr"}, black, reflected));
        RAYPAGER_TRY(color(parameters, {"Kt"}, black, refracted));
        RAYPAGER_TRY(color(parameters, {"opacity"}, white_surface, opacity));
        material.ior = ior;
        material.flags = reflected == black && refracted == black ? 0 : RP_MATERIAL_SOLID | RP_MATERIAL_CLEAR;
        store_unit(reflected, material.mirror);
        store_unit(refracted, material.refracted);
    }
    store_unit(diffuse, material.color);
    store_unit(specular, material.specular);
    make_translucent(directive, opacity, material);
    return parameters.status();
}

Status PbrtReader::coated(const Directive& directive, const std::string& type, const PbrtParameters& parameters, rp_material& material) {
    const bool metal = type == "coatedconductor";
    const std::string prefix = metal ? "interface." : "";
    float ior = 1.5f, alpha = 0;
    RAYPAGER_TRY(index_of_refraction(directive, parameters, prefix, ior));
    RAYPAGER_TRY(roughness(parameters, prefix, false, 0, alpha));
    if (!(ior >= 1)) return error(directive, fmt::format("a coat has an index of refraction of at least 1, not {}", ior));
    Float3 medium;
    RAYPAGER_TRY(color(parameters, {"albedo"}, {0, 0, 0}, medium));
    if (medium != Float3{0, 0, 0}) warn(directive.location, fmt::format("Material \"{}\": a coat that scatters is not supported; it is clear", type));
    for (const std::string_view unused : {"thickness", "interface.thickness", "g", "maxdepth", "nsamples"}) parameters.find(unused);
    if (!metal) {
        Float3 reflectance;
        RAYPAGER_TRY(color(parameters, {"reflectance"}, mid_grey, reflectance));
        material = coated_diffuse_material(reflectance, ior, alpha);
        return parameters.status();
    }
    rp_material base{};
    RAYPAGER_TRY(conductor(parameters, "conductor.", false, base));
    if (parameters.find("reflectance")) {
        Float3 reflectance;
        RAYPAGER_TRY(color(parameters, {"reflectance"}, white_surface, reflectance));
        base = conductor_of_reflectance(reflectance, base.alpha);
    }
    material = coated_conductor_material({base.eta[0], base.eta[1], base.eta[2]}, {base.k[0], base.k[1], base.k[2]}, base.alpha, ior, alpha);
    return parameters.status();
}

// Disney's material by the one of glTF, and glass for what is let through.
Status PbrtReader::disney(const Directive& directive, const PbrtParameters& parameters, rp_material& material) {
    Float3 base;
    float ior = 1.5f;
    RAYPAGER_TRY(color(parameters, {"color"}, mid_grey, base));
    RAYPAGER_TRY(index_of_refraction(directive, parameters, "", ior));
    const auto metallic = static_cast<float>(std::clamp(parameters.number("metallic", 0), 0.0, 1.0));
    const double roughness = std::clamp(parameters.number("roughness", 0.5), 0.0, 1.0),
                 through = std::clamp(parameters.number("spectrans", 0), 0.0, 1.0);
    RAYPAGER_TRY(parameters.status());
    for (const std::string_view lobe : {"sheen", "clearcoat", "flatness", "scatterdistance", "anisotropic", "difftrans"}) {
        const PbrtParameter* p = parameters.find(lobe);
        if (p && (p->type == "texture" || std::ranges::any_of(p->numbers, [](double x) { return x > 0; })))
            warn(p->location, fmt::format("parameter \"{}\" of Material \"disney\" is not supported; the surface is without it", lobe));
    }
    for (const std::string_view unused : {"sheentint", "clearcoatgloss", "speculartint", "thin"}) parameters.find(unused);
    const float straight = (ior - 1) / (ior + 1) * ((ior - 1) / (ior + 1));
    const auto at_normal = [&](float c) { return std::lerp(straight, c, metallic); };
    const auto alpha = static_cast<float>(std::max(roughness * roughness, 1e-3));
    material = glossy_material(times(base, 1 - metallic), {at_normal(base.x), at_normal(base.y), at_normal(base.z)}, alpha);
    if (through * (1 - metallic) > 0) {
        const auto first = static_cast<uint32_t>(scene_.materials.size());
        const auto root = [](float c) { return std::sqrt(c); };  // a ray passes two surfaces
        scene_.materials.push_back(material);
        scene_.materials.push_back(dielectric_material(ior, alpha, white_surface, {root(base.x), root(base.y), root(base.z)}));
        material = mix_material(first, first + 1, static_cast<float>(through) * (1 - metallic));
    }
    return {};
}

// Of two materials, one or the other at each hit of a path.
Status PbrtReader::mix_materials(const Directive& directive, const PbrtParameters& parameters, rp_material& material) {
    std::string names[2] = {parameters.text("namedmaterial1", ""), parameters.text("namedmaterial2", "")};
    double second = 0.5;
    if (const PbrtParameter* both = parameters.find("materials"); both && both->strings.size() == 2) {
        names[0] = both->strings[0];
        names[1] = both->strings[1];
        second = parameters.number("amount", 0.5);
    } else {  // version 3, where the amount is a colour, and that of the first
        Float3 first;
        RAYPAGER_TRY(color(parameters, {"amount"}, mid_grey, first));
        if (first.x != first.y || first.y != first.z) warn(directive.location, "Material \"mix\" by a colour is not supported; its mean is used");
        second = 1 - mean(first);
    }
    RAYPAGER_TRY(parameters.status());
    uint32_t parts[2] = {};
    for (size_t i = 0; i < 2; ++i) {
        const auto found = named_materials_.find(names[i]);
        if (found != named_materials_.end() && found->second != no_surface) {
            parts[i] = found->second;
            continue;
        }
        const bool is_there = found != named_materials_.end() || names[i] == "interface";
        if (!is_there) warn(directive.location, fmt::format("there is no material \"{}\" to mix; grey is used", clipped(names[i])));
        parts[i] = static_cast<uint32_t>(scene_.materials.size());
        scene_.materials.push_back(is_there ? clear_material() : diffuse_material(mid_grey));
    }
    material = mix_material(parts[0], parts[1], static_cast<float>(second));
    if (std::max(mix_depth(scene_.materials, parts[0]), mix_depth(scene_.materials, parts[1])) >= RP_MAX_MIXES) {
        warn(directive.location,
             fmt::format("Material \"mix\" more than {} times within another; the one with the larger share is used", RP_MAX_MIXES));
        material = scene_.materials[parts[second > 0.5 ? 1 : 0]];
    }
    return {};
}

// Materials that are not there become a diffuse one of the colour that decides their look, under a coat where they have a smooth surface.
Status PbrtReader::approximate_material(const Directive& directive, const std::string& type, const PbrtParameters& parameters,
                                        rp_material& material) {
    Float3 reflectance = mid_grey;
    if (type == "kdsubsurface" || type == "subsurface") {
        RAYPAGER_TRY(color(parameters, {"Kd", "reflectance"}, mid_grey, reflectance));
        float ior = 1.33f, alpha = 0;
        if (parameters.find({"eta", "index"})) RAYPAGER_TRY(index_of_refraction(directive, parameters, "", ior));
        RAYPAGER_TRY(roughness(parameters, "", type == "kdsubsurface", 0, alpha));
        warn(directive.location,
             fmt::format("Material \"{}\" is not supported: no light passes below its surface; a coated diffuse one is used", type));
        material = coated_diffuse_material(reflectance, std::max(ior, 1.0f), alpha);
        return {};
    }
    RAYPAGER_TRY(color(parameters, {"color", "reflectance", "Kd"}, mid_grey, reflectance));
    RAYPAGER_TRY(parameters.status());
    warn(directive.location, fmt::format("Material \"{}\" is not supported; a diffuse one of its colour is used", clipped(type)));
    material = diffuse_material(reflectance);
    return {};
}

Status PbrtReader::describe_material(const Directive& directive, const std::string& type, const PbrtParameters& parameters, rp_material& material) {
    Float3 reflectance;
    if (type == "diffuse" || type == "matte") {
        RAYPAGER_TRY(color(parameters, {"reflectance", "Kd"}, mid_grey, reflectance));
        material = rough_diffuse_material(reflectance, parameters.number("sigma", 0));
    } else if (type == "conductor" || type == "metal") {
        RAYPAGER_TRY(conductor(parameters, "", type == "metal", material));
    } else if (type == "mirror") {
        RAYPAGER_TRY(color(parameters, {"reflectance", "Kr"}, {0.9f, 0.9f, 0.9f}, reflectance));
        material = conductor_of_reflectance(reflectance, 0);
    } else if (type == "dielectric" || type == "glass") {
        RAYPAGER_TRY(dielectric(directive, parameters, type == "glass", material));
    } else if (type == "thindielectric") {
        float ior = 1.5f;
        RAYPAGER_TRY(index_of_refraction(directive, parameters, "", ior));
        material = thin_dielectric_material(ior);
    } else if (type == "plastic" || type == "uber" || type == "substrate" || type == "translucent") {
        RAYPAGER_TRY(glossy(directive, type, parameters, material));
    } else if (type == "coateddiffuse" || type == "coatedconductor") {
        RAYPAGER_TRY(coated(directive, type, parameters, material));
    } else if (type == "diffusetransmission") {
        Float3 transmittance;
        RAYPAGER_TRY(color(parameters, {"reflectance"}, quarter_grey, reflectance));
        RAYPAGER_TRY(color(parameters, {"transmittance"}, quarter_grey, transmittance));
        const double scale = std::max(parameters.number("scale", 1), 0.0);
        material = translucent_material(times(reflectance, scale), times(transmittance, scale));
    } else if (type == "disney") {
        RAYPAGER_TRY(disney(directive, parameters, material));
    } else if (type == "mix") {
        RAYPAGER_TRY(mix_materials(directive, parameters, material));
    } else {
        return approximate_material(directive, type, parameters, material);
    }
    warn_of_unused(directive, type, parameters, {"type", "name"});
    return parameters.status();
}

// A bump map that is the same everywhere makes no bumps.
void PbrtReader::warn_of_bumps(const PbrtParameters& parameters) {
    for (const std::string_view name : {"displacement", "bumpmap"}) {
        const PbrtParameter* p = parameters.find(name);
        if (!p || p->type != "texture" || p->strings.size() != 1) continue;
        const auto texture = textures_.floats.find(p->strings[0]);
        if (texture != textures_.floats.end() && texture->second.approximated.empty()) continue;
        warn(p->location, fmt::format("parameter \"{}\" is not supported; the surface stays as it is", name));
    }
    warn_if_present(parameters, {"normalmap"}, "the surface stays as it is");
}

Status PbrtReader::make_material(const Directive& directive, const std::string& type, const PbrtParameters& parameters, uint32_t& index) {
    if (std::find(version_3_materials.begin(), version_3_materials.end(), type) != version_3_materials.end()) seems_version(3);
    if (std::find(version_4_materials.begin(), version_4_materials.end(), type) != version_4_materials.end()) seems_version(4);
    if (type.empty() || type == "none" || type == "interface") {
        index = no_surface;
        return {};
    }
    warn_of_bumps(parameters);
    rp_material material{};
    RAYPAGER_TRY(describe_material(directive, type, parameters, material));
    index = static_cast<uint32_t>(scene_.materials.size());
    scene_.materials.push_back(material);
    const Status sound = check_material(scene_.materials, index);
    return sound.ok() ? Status() : error(directive, sound.message());
}

Status PbrtReader::material(const Directive& directive) {
    std::string type;
    PbrtParameters parameters = no_parameters();
    RAYPAGER_TRY(take_type_and_parameters(type, parameters));
    return make_material(directive, type, parameters, state_.material);
}

Status PbrtReader::make_named_material(const Directive& directive) {
    std::string name;
    PbrtParameters parameters = no_parameters();
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
        warn(directive.location, fmt::format("there is no material \"{}\"; what is in force stays", clipped(name)));
    else
        state_.material = found->second;
    return {};
}

}  // namespace raypager
