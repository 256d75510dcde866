#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "import/pbrt_reader.hpp"
#include "import/pbrt_spectra.hpp"
#include "import/text.hpp"
#include "raypager/materials.hpp"

namespace raypager {
namespace {

constexpr Float3 mid_grey{0.5f, 0.5f, 0.5f}, quarter_grey{0.25f, 0.25f, 0.25f}, white_surface{1, 1, 1};

float mean(const Float3& c) { return (c.x + c.y + c.z) / 3; }

Float3 times(const Float3& c, double factor) {
    const auto f = static_cast<float>(factor);
    return {c.x * f, c.y * f, c.z * f};
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

// Anisotropy is averaged away.
Status PbrtReader::conductor(const PbrtParameters& parameters, const std::string& prefix, bool version_3, rp_material& material) {
    const std::string u = prefix + "uroughness", v = prefix + "vroughness", both = prefix + "roughness";
    const double usual = version_3 ? 0.01 : 0;
    const double u_roughness = parameters.number({u, both}, usual), v_roughness = parameters.number({v, both}, usual);
    RAYPAGER_TRY(parameters.status());
    if (u_roughness != v_roughness)
        warn(parameters.find({u, v})->location, "anisotropic roughness is not supported; the mean of both directions is used");
    double roughness = (u_roughness + v_roughness) / 2;
    if (parameters.boolean("remaproughness", true)) roughness = alpha_of_roughness(roughness, version_3);
    constexpr double smooth = 1e-3;  // what pbrt-v4 takes for a mirror
    const double alpha = roughness < smooth ? 0 : std::min(roughness, 1.0);

    const std::string reflectance = prefix + "reflectance";
    if (parameters.find(reflectance)) {
        Float3 value;
        RAYPAGER_TRY(color(parameters, {reflectance}, white_surface, value));
        material = conductor_of_reflectance(value, static_cast<float>(alpha));
        return parameters.status();
    }
    Float3 eta, k;
    RAYPAGER_TRY(color(parameters, {prefix + "eta"}, *named_spectrum("metal-Cu-eta"), eta));
    RAYPAGER_TRY(color(parameters, {prefix + "k"}, *named_spectrum("metal-Cu-k"), k));
    material = conductor_material(eta, k, static_cast<float>(alpha));
    return parameters.status();
}

Status PbrtReader::dielectric(const Directive& directive, const PbrtParameters& parameters, rp_material& material) {
    const PbrtParameter* index = parameters.find({"eta", "index"});
    Float3 eta{1.5f, 1.5f, 1.5f};
    if (index && index->type == "texture")
        eta = times(white_surface, parameters.number(index->name, 1.5));
    else
        RAYPAGER_TRY(color(parameters, {"eta", "index"}, eta, eta));
    RAYPAGER_TRY(parameters.status());
    if (!(mean(eta) > 0)) return error(directive, "the index of refraction must be more than 0");
    if (eta.x != eta.y || eta.y != eta.z) warn(directive.location, "dispersion is not supported; the mean index of refraction is used");
    if (parameters.number({"uroughness", "roughness"}, 0) > 0 || parameters.number({"vroughness", "roughness"}, 0) > 0)
        warn(directive.location, "rough dielectrics are not supported; the surface is smooth");
    parameters.find("remaproughness");
    for (const std::string_view name : {"Kr", "Kt"}) {
        Float3 share;
        RAYPAGER_TRY(color(parameters, {name}, white_surface, share));
        if (share != white_surface)
            warn(parameters.find(name)->location, fmt::format("parameter \"{}\" is not supported; glass reflects and transmits all light", name));
    }
    material = dielectric_material(mean(eta));
    return parameters.status();
}

// Of two diffuse materials the one between them, of others the one that there is more of.
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
        second = 1 - mean(first);
    }
    RAYPAGER_TRY(parameters.status());
    second = std::clamp(second, 0.0, 1.0);
    const rp_material* parts[2] = {};
    for (size_t i = 0; i < 2; ++i) {
        const auto found = named_materials_.find(names[i]);
        if (found == named_materials_.end())
            warn(directive.location, fmt::format("there is no material \"{}\" to mix; grey is used", clipped(names[i])));
        else if (found->second != no_surface)
            parts[i] = &scene_.materials[found->second];
    }
    warn(directive.location, "Material \"mix\" is not supported; one material between the two, or the one with the larger share, is used");
    const rp_material grey = diffuse_material(mid_grey);
    const rp_material& a = parts[0] ? *parts[0] : grey;
    const rp_material& b = parts[1] ? *parts[1] : grey;
    const rp_material larger = second > 0.5 ? b : a;
    material = larger;
    if (a.kind == RP_MATERIAL_DIFFUSE && b.kind == RP_MATERIAL_DIFFUSE)
        for (size_t i = 0; i < 3; ++i) material.color[i] = std::lerp(a.color[i], b.color[i], static_cast<float>(second));
    return {};
}

// Materials that are not there become a diffuse one, of the colour that decides their look.
Status PbrtReader::approximate_material(const Directive& directive, const std::string& type, const PbrtParameters& parameters,
                                        rp_material& material) {
    Float3 reflectance = mid_grey;
    if (type == "mix") return mix_materials(directive, parameters, material);
    if (type == "uber" || type == "plastic") {
        RAYPAGER_TRY(color(parameters, {"Kd"}, quarter_grey, reflectance));
    } else if (type == "substrate" || type == "kdsubsurface") {
        RAYPAGER_TRY(color(parameters, {"Kd"}, mid_grey, reflectance));
    } else if (type == "translucent") {
        Float3 share;
        RAYPAGER_TRY(color(parameters, {"Kd"}, quarter_grey, reflectance));
        RAYPAGER_TRY(color(parameters, {"reflect"}, mid_grey, share));
        reflectance = {reflectance.x * share.x, reflectance.y * share.y, reflectance.z * share.z};
    } else if (type == "disney" || type == "hair") {
        RAYPAGER_TRY(color(parameters, {"color", "reflectance"}, mid_grey, reflectance));
    } else if (type == "diffusetransmission") {
        RAYPAGER_TRY(color(parameters, {"reflectance"}, quarter_grey, reflectance));
        reflectance = times(reflectance, std::max(parameters.number("scale", 1), 0.0));
    } else {
        RAYPAGER_TRY(color(parameters, {"reflectance", "Kd", "color"}, mid_grey, reflectance));
    }
    RAYPAGER_TRY(parameters.status());
    warn(directive.location, fmt::format("Material \"{}\" is not supported; a diffuse one of its colour is used", clipped(type)));
    material = diffuse_material(reflectance);
    return {};
}

Status PbrtReader::describe_material(const Directive& directive, const std::string& type, const PbrtParameters& parameters, rp_material& material) {
    Float3 reflectance;
    if (type == "diffuse" || type == "matte") {
        RAYPAGER_TRY(color(parameters, {"reflectance", "Kd"}, mid_grey, reflectance));
        if (parameters.number("sigma", 0) > 0) warn(directive.location, "rough diffuse surfaces are not supported; sigma is taken as 0");
        material = diffuse_material(reflectance);
    } else if (type == "conductor" || type == "metal") {
        RAYPAGER_TRY(conductor(parameters, "", type == "metal", material));
    } else if (type == "mirror") {
        RAYPAGER_TRY(color(parameters, {"reflectance", "Kr"}, {0.9f, 0.9f, 0.9f}, reflectance));
        material = conductor_of_reflectance(reflectance, 0);
    } else if (type == "dielectric" || type == "glass") {
        RAYPAGER_TRY(dielectric(directive, parameters, material));
    } else if (type == "thindielectric") {
        warn(directive.location, "Material \"thindielectric\" is not supported; a solid dielectric is used");
        RAYPAGER_TRY(dielectric(directive, parameters, material));
    } else if (type == "coatedconductor") {
        warn(directive.location, "Material \"coatedconductor\" is not supported; the conductor is used without its coat");
        const bool bare = parameters.find("reflectance") != nullptr;
        return conductor(parameters, bare ? "" : "conductor.", false, material);
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
    for (size_t i = 0; i < 3; ++i)
        if (material.kind == RP_MATERIAL_CONDUCTOR && material.eta[i] == 0 && material.k[i] == 0)
            return error(directive, "eta and k must not both be 0");
    index = static_cast<uint32_t>(scene_.materials.size());
    scene_.materials.push_back(material);
    return {};
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
