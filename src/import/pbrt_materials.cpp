#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "import/pbrt_reader.hpp"
#include "import/pbrt_spectra.hpp"
#include "import/text.hpp"
#include "raypager/materials.hpp"
#include "scene/check_material.hpp"
#include "scene/texture_use.hpp"

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

}  // namespace

Status PbrtReader::conductor(const PbrtParameters& parameters, const std::string& prefix, bool version_3, TexturedMaterial& material) {
    PbrtRoughness rough;
    RAYPAGER_TRY(roughness(parameters, prefix, version_3, version_3 ? 0.01 : 0, rough));
    const std::string reflectance = prefix + "reflectance";
    if (parameters.find(reflectance)) {
        Texture value;
        RAYPAGER_TRY(color_texture(parameters, {reflectance}, white_surface, value));
        material.material = conductor_of_reflectance(value.mean(), rough.along.alpha);
        if (!value.is_constant()) material.textures.push_back({RP_PARAMETER_METAL, value});
        rough.set(0, material);
        return parameters.status();
    }
    Float3 eta, k;
    RAYPAGER_TRY(color(parameters, {prefix + "eta"}, *named_spectrum("metal-Cu-eta"), eta));
    RAYPAGER_TRY(color(parameters, {prefix + "k"}, *named_spectrum("metal-Cu-k"), k));
    material.material = conductor_material(eta, k, rough.along.alpha);
    rough.set(0, material);
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

Status PbrtReader::dielectric(const Directive& directive, const PbrtParameters& parameters, bool version_3, TexturedMaterial& material) {
    float ior = 1.5f;
    PbrtRoughness rough;
    Texture reflected, refracted;
    RAYPAGER_TRY(index_of_refraction(directive, parameters, "", ior));
    RAYPAGER_TRY(roughness(parameters, "", version_3, 0, rough));
    RAYPAGER_TRY(color_texture(parameters, {"Kr"}, white_surface, reflected));
    RAYPAGER_TRY(color_texture(parameters, {"Kt"}, white_surface, refracted));
    if (rough.is_textured() || !reflected.is_constant() || !refracted.is_constant()) {
        material.material = dielectric_material(ior, std::max(rough.along.alpha, rough.is_textured() ? 1e-3f : 0), mid_grey, mid_grey);
        material.set(RP_PARAMETER_SPECULAR, reflected, material.material.specular);
        material.set(RP_PARAMETER_REFRACTED, refracted, material.material.refracted);
    } else {
        material.material = dielectric_material(ior, rough.along.alpha, reflected.mean(), refracted.mean());
    }
    rough.set(0, material);
    return parameters.status();
}

// Adds it to the scene.
uint32_t PbrtReader::keep_material(const Directive& directive, const TexturedMaterial& material) {
    if (!add_material(scene_, material))
        warn(directive.location, "the textures of a material are more than a path can keep; their mid values are used");
    return static_cast<uint32_t>(scene_.materials.size() - 1);
}

// A mix with what lets everything through. opacity: 0 to 1 by channel; of a coloured one the mean counts.
void PbrtReader::make_translucent(const Directive& directive, const Texture& opacity, TexturedMaterial& material) {
    const Float3& mean_opacity = opacity.mean();
    if (opacity.is_constant()) {
        if (mean_opacity.x >= 1 && mean_opacity.y >= 1 && mean_opacity.z >= 1) return;
        if (mean_opacity.x != mean_opacity.y || mean_opacity.y != mean_opacity.z)
            warn(directive.location, "coloured opacity is not supported; its mean is used");
    }
    const uint32_t clear = keep_material(directive, {clear_material(), {}}), itself = keep_material(directive, material);
    material = {mix_material(clear, itself, mean(mean_opacity)), {}};
    if (!opacity.is_constant()) material.textures.push_back({RP_PARAMETER_AMOUNT, opacity});
}

// The materials of version 3 that add gloss to a diffuse base.
Status PbrtReader::glossy(const Directive& directive, const std::string& type, const PbrtParameters& parameters, TexturedMaterial& material) {
    const bool substrate = type == "substrate";
    const Texture black(0.0);
    Texture diffuse, specular, opacity(1.0);
    PbrtRoughness rough;
    RAYPAGER_TRY(color_texture(parameters, {"Kd"}, substrate ? mid_grey : quarter_grey, diffuse));
    RAYPAGER_TRY(color_texture(parameters, {"Ks"}, substrate ? mid_grey : quarter_grey, specular));
    RAYPAGER_TRY(roughness(parameters, "", true, 0.1, rough));
    rp_material& m = material.material;
    m = rp_material{};
    m.kind = RP_MATERIAL_LAYERED;
    m.ior = 1.5f;
    rough.set(1e-3f, material);
    if (substrate) {
        m.flags = RP_MATERIAL_BLEND;
    } else if (type == "translucent") {
        Texture share, through;
        RAYPAGER_TRY(color_texture(parameters, {"reflect"}, mid_grey, share));
        RAYPAGER_TRY(color_texture(parameters, {"transmit"}, mid_grey, through));
        m.flags = RP_MATERIAL_SOLID;
        material.set(RP_PARAMETER_TRANSMITTANCE, diffuse * through, m.transmittance);
        material.set(RP_PARAMETER_REFRACTED, specular * through, m.refracted);
        diffuse = diffuse * share;
        specular = specular * share;
    } else if (type == "uber") {
        Texture reflected, refracted;
        RAYPAGER_TRY(index_of_refraction(directive, parameters, "", m.ior));
        RAYPAGER_TRY(color_texture(parameters, {"Kr"}, black.mean(), reflected));
        RAYPAGER_TRY(color_texture(parameters, {"Kt"}, black.mean(), refracted));
        RAYPAGER_TRY(color_texture(parameters, {"opacity"}, white_surface, opacity));
        const bool none = reflected.is_constant() && refracted.is_constant() && reflected.mean() == black.mean() && refracted.mean() == black.mean();
        m.flags = none ? 0 : RP_MATERIAL_SOLID | RP_MATERIAL_SMOOTH_REFRACTION;
        material.set(RP_PARAMETER_MIRROR, reflected, m.mirror);
        material.set(RP_PARAMETER_REFRACTED, refracted, m.refracted);
    }
    material.set(RP_PARAMETER_COLOR, diffuse, m.color);
    material.set(RP_PARAMETER_SPECULAR, specular, m.specular);
    make_translucent(directive, opacity, material);
    return parameters.status();
}

Status PbrtReader::coated(const Directive& directive, const std::string& type, const PbrtParameters& parameters, TexturedMaterial& material) {
    const bool metal = type == "coatedconductor";
    const std::string prefix = metal ? "interface." : "";
    float ior = 1.5f;
    PbrtRoughness rough;
    RAYPAGER_TRY(index_of_refraction(directive, parameters, prefix, ior));
    RAYPAGER_TRY(roughness(parameters, prefix, false, 0, rough));
    if (!(ior >= 1)) return error(directive, fmt::format("a coat has an index of refraction of at least 1, not {}", ior));
    Float3 medium;
    RAYPAGER_TRY(color(parameters, {"albedo"}, {0, 0, 0}, medium));
    if (medium != Float3{0, 0, 0}) warn(directive.location, fmt::format("Material \"{}\": a coat that scatters is not supported; it is clear", type));
    for (const std::string_view unused : {"thickness", "interface.thickness", "g", "maxdepth", "nsamples"}) parameters.find(unused);
    if (!metal) {
        Texture reflectance;
        RAYPAGER_TRY(color_texture(parameters, {"reflectance"}, mid_grey, reflectance));
        material.material = coated_diffuse_material(reflectance.mean(), ior, rough.along.alpha);
        material.set(RP_PARAMETER_COLOR, reflectance, material.material.color);
        rough.set(0, material);
        return parameters.status();
    }
    TexturedMaterial metal_base;
    RAYPAGER_TRY(conductor(parameters, "conductor.", false, metal_base));
    rp_material& base = metal_base.material;
    if (parameters.find("reflectance")) {
        Float3 reflectance;
        RAYPAGER_TRY(color(parameters, {"reflectance"}, white_surface, reflectance));
        base = anisotropic(conductor_of_reflectance(reflectance, base.alpha), RP_ALPHA_ACROSS(base));
    }
    material.material =
        coated_conductor_material({base.eta[0], base.eta[1], base.eta[2]}, {base.k[0], base.k[1], base.k[2]}, base.alpha, ior, rough.along.alpha);
    if (is_anisotropic(base)) {
        material.material.base_alpha = base.alpha;
        RP_BASE_ALPHA_ACROSS(material.material) = RP_ALPHA_ACROSS(base);
    }
    rough.set(0, material);
    for (TexturedMaterial::Parameter p : metal_base.textures) {
        if (p.parameter == RP_PARAMETER_METAL) {
            warn(directive.location, "a texture of a coated conductor's reflectance is not supported; one mid value is used");
            continue;
        }
        p.parameter = p.parameter == RP_PARAMETER_ALPHA_ACROSS ? RP_PARAMETER_BASE_ALPHA_ACROSS : RP_PARAMETER_BASE_ALPHA;
        material.textures.push_back(p);
    }
    return parameters.status();
}

// Disney's material by the one of glTF, and glass for what is let through.
Status PbrtReader::disney(const Directive& directive, const PbrtParameters& parameters, TexturedMaterial& material) {
    Texture base, metallic, roughness;
    float ior = 1.5f;
    RAYPAGER_TRY(color_texture(parameters, {"color"}, mid_grey, base));
    RAYPAGER_TRY(index_of_refraction(directive, parameters, "", ior));
    RAYPAGER_TRY(number_texture(parameters, {"metallic"}, 0, metallic));
    RAYPAGER_TRY(number_texture(parameters, {"roughness"}, 0.5, roughness));
    const double through = std::clamp(parameters.number("spectrans", 0), 0.0, 1.0);
    RAYPAGER_TRY(parameters.status());
    for (const std::string_view lobe : {"sheen", "clearcoat", "flatness", "scatterdistance", "anisotropic", "difftrans"}) {
        const PbrtParameter* p = parameters.find(lobe);
        if (p && (p->type == "texture" || std::ranges::any_of(p->numbers, [](double x) { return x > 0; })))
            warn(p->location, fmt::format("parameter \"{}\" of Material \"disney\" is not supported; the surface is without it", lobe));
    }
    for (const std::string_view unused : {"sheentint", "clearcoatgloss", "speculartint", "thin"}) parameters.find(unused);
    const Texture straight(double{(ior - 1) / (ior + 1) * ((ior - 1) / (ior + 1))}), alpha = roughness * roughness;
    const Texture diffuse = base * one_minus(metallic), specular = mixed(straight, base, metallic);
    const float rough = std::clamp(alpha.mean().x, 1e-3f, 1.0f), dielectric = std::clamp(1 - metallic.mean().x, 0.0f, 1.0f);
    material.material = glossy_material(diffuse.mean(), specular.mean(), rough);
    material.set(RP_PARAMETER_COLOR, diffuse, material.material.color);
    material.set(RP_PARAMETER_SPECULAR, specular, material.material.specular);
    if (!alpha.is_constant()) material.textures.push_back({RP_PARAMETER_ALPHA, alpha});
    if (through * dielectric <= 0) return {};
    if (!metallic.is_constant()) warn(directive.location, "Material \"disney\": what is let through does not vary with \"metallic\"");
    if (!base.is_constant()) warn(directive.location, "Material \"disney\": what is let through has one mid colour");
    const auto root = [](float c) { return std::sqrt(c); };  // a ray passes two surfaces
    const Float3& c = base.mean();
    const uint32_t opaque = keep_material(directive, material);
    const uint32_t glass = keep_material(directive, {dielectric_material(ior, rough, white_surface, {root(c.x), root(c.y), root(c.z)}), {}});
    material = {mix_material(opaque, glass, static_cast<float>(through) * dielectric), {}};
    return {};
}

// Of two materials, one or the other at each hit of a path.
Status PbrtReader::mix_materials(const Directive& directive, const PbrtParameters& parameters, TexturedMaterial& material) {
    std::string names[2] = {parameters.text("namedmaterial1", ""), parameters.text("namedmaterial2", "")};
    Texture second(0.5);
    if (const PbrtParameter* both = parameters.find("materials"); both && both->strings.size() == 2) {
        names[0] = both->strings[0];
        names[1] = both->strings[1];
        RAYPAGER_TRY(number_texture(parameters, {"amount"}, 0.5, second));
    } else {  // version 3, where the amount is a colour, and that of the first
        Texture first;
        RAYPAGER_TRY(color_texture(parameters, {"amount"}, mid_grey, first));
        const Float3& c = first.mean();
        if (c.x != c.y || c.y != c.z) warn(directive.location, "Material \"mix\" by a colour is not supported; its mean is used");
        second = first.is_constant() ? Texture(double{1 - mean(c)}) : one_minus(first);
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
    material = {mix_material(parts[0], parts[1], second.mean().x), {}};
    if (!second.is_constant()) material.textures.push_back({RP_PARAMETER_AMOUNT, second});
    if (std::max(mix_depth(scene_.materials, parts[0]), mix_depth(scene_.materials, parts[1])) >= RP_MAX_MIXES) {
        warn(directive.location,
             fmt::format("Material \"mix\" more than {} times within another; the one with the larger share is used", RP_MAX_MIXES));
        material = {scene_.materials[parts[second.mean().x > 0.5f ? 1 : 0]], {}};
    }
    return {};
}

// Materials that are not there become a diffuse one of the colour that decides their look, under a coat where they have a smooth surface.
Status PbrtReader::approximate_material(const Directive& directive, const std::string& type, const PbrtParameters& parameters,
                                        TexturedMaterial& material) {
    Texture reflectance;
    if (type == "kdsubsurface" || type == "subsurface") {
        RAYPAGER_TRY(color_texture(parameters, {"Kd", "reflectance"}, mid_grey, reflectance));
        float ior = 1.33f;
        PbrtRoughness rough;
        if (parameters.find({"eta", "index"})) RAYPAGER_TRY(index_of_refraction(directive, parameters, "", ior));
        RAYPAGER_TRY(roughness(parameters, "", type == "kdsubsurface", 0, rough));
        warn(directive.location,
             fmt::format("Material \"{}\" is not supported: no light passes below its surface; a coated diffuse one is used", type));
        material.material = coated_diffuse_material(reflectance.mean(), std::max(ior, 1.0f), rough.along.alpha);
        material.set(RP_PARAMETER_COLOR, reflectance, material.material.color);
        rough.set(0, material);
        return {};
    }
    RAYPAGER_TRY(color_texture(parameters, {"color", "reflectance", "Kd"}, mid_grey, reflectance));
    RAYPAGER_TRY(parameters.status());
    warn(directive.location, fmt::format("Material \"{}\" is not supported; a diffuse one of its colour is used", clipped(type)));
    material.material = diffuse_material(reflectance.mean());
    material.set(RP_PARAMETER_COLOR, reflectance, material.material.color);
    return {};
}

Status PbrtReader::describe_material(const Directive& directive, const std::string& type, const PbrtParameters& parameters,
                                     TexturedMaterial& material) {
    Texture reflectance;
    if (type == "diffuse" || type == "matte") {
        RAYPAGER_TRY(color_texture(parameters, {"reflectance", "Kd"}, mid_grey, reflectance));
        material.material = rough_diffuse_material(reflectance.mean(), parameters.number("sigma", 0));
        material.set(RP_PARAMETER_COLOR, reflectance, material.material.color);
    } else if (type == "conductor" || type == "metal") {
        RAYPAGER_TRY(conductor(parameters, "", type == "metal", material));
    } else if (type == "mirror") {
        RAYPAGER_TRY(color_texture(parameters, {"reflectance", "Kr"}, {0.9f, 0.9f, 0.9f}, reflectance));
        material.material = conductor_of_reflectance(reflectance.mean(), 0);
        if (!reflectance.is_constant()) material.textures.push_back({RP_PARAMETER_METAL, reflectance});
    } else if (type == "dielectric" || type == "glass") {
        RAYPAGER_TRY(dielectric(directive, parameters, type == "glass", material));
    } else if (type == "thindielectric") {
        float ior = 1.5f;
        RAYPAGER_TRY(index_of_refraction(directive, parameters, "", ior));
        material.material = thin_dielectric_material(ior);
    } else if (type == "plastic" || type == "uber" || type == "substrate" || type == "translucent") {
        RAYPAGER_TRY(glossy(directive, type, parameters, material));
    } else if (type == "coateddiffuse" || type == "coatedconductor") {
        RAYPAGER_TRY(coated(directive, type, parameters, material));
    } else if (type == "diffusetransmission") {
        Texture transmittance;
        RAYPAGER_TRY(color_texture(parameters, {"reflectance"}, quarter_grey, reflectance));
        RAYPAGER_TRY(color_texture(parameters, {"transmittance"}, quarter_grey, transmittance));
        const Texture factor(std::max(parameters.number("scale", 1), 0.0));
        material.material = translucent_material({}, {});
        material.set(RP_PARAMETER_COLOR, reflectance * factor, material.material.color);
        material.set(RP_PARAMETER_TRANSMITTANCE, transmittance * factor, material.material.transmittance);
    } else if (type == "disney") {
        RAYPAGER_TRY(disney(directive, parameters, material));
    } else if (type == "mix") {
        RAYPAGER_TRY(mix_materials(directive, parameters, material));
    } else {
        return approximate_material(directive, type, parameters, material);
    }
    warn_of_unused(directive, type, parameters, {"type", "name", "displacement", "bumpmap", "normalmap"});
    return parameters.status();
}

// What changes normals. A bump map that is the same everywhere makes no bumps.
Status PbrtReader::bumps(const Directive& directive, const PbrtParameters& parameters, TexturedMaterial& material) {
    if (material.material.kind == RP_MATERIAL_MIX) {
        for (const std::string_view name : {"displacement", "bumpmap", "normalmap"})
            if (const PbrtParameter* p = parameters.find(name))
                warn(p->location, fmt::format("parameter \"{}\" of a mix is not supported; the surface stays as it is", name));
        return {};
    }
    if (const PbrtParameter* file = parameters.find("normalmap")) {
        std::shared_ptr<const ImageSource> source;
        RAYPAGER_TRY(image_source(directive, *file, {ImageEncoding::Kind::linear, 1}, source));
        rp_texture_map map{};
        map.kind = RP_MAP_UV;
        map.m[0] = map.m[6] = 1;
        map.m[5] = -1;
        material.textures.push_back({RP_PARAMETER_NORMAL, Texture::image(std::move(source), texture_op(RP_TEXTURE_IMAGE), map)});
    }
    for (const std::string_view name : {"displacement", "bumpmap"}) {
        if (!parameters.find(name)) continue;
        Texture height;
        RAYPAGER_TRY(number_texture(parameters, {name}, 0, height));
        if (!height.is_constant()) material.height = height;
    }
    return {};
}

Status PbrtReader::make_material(const Directive& directive, const std::string& type, const PbrtParameters& parameters, uint32_t& index) {
    if (std::find(version_3_materials.begin(), version_3_materials.end(), type) != version_3_materials.end()) seems_version(3);
    if (std::find(version_4_materials.begin(), version_4_materials.end(), type) != version_4_materials.end()) seems_version(4);
    if (type.empty() || type == "none" || type == "interface") {
        index = no_surface;
        return {};
    }
    TexturedMaterial material;
    RAYPAGER_TRY(describe_material(directive, type, parameters, material));
    RAYPAGER_TRY(bumps(directive, parameters, material));
    index = keep_material(directive, material);
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
