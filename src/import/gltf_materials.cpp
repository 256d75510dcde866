#include "import/gltf_materials.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "raypager/materials.hpp"

namespace raypager {
namespace {

constexpr Float3 all_of_it{1, 1, 1};

float greatest(const Float3& c) { return std::max({c.x, c.y, c.z}); }
Float3 product(const Float3& a, const Float3& b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }
Float3 by_factor(const Float3& c, double by) { return {static_cast<float>(c.x * by), static_cast<float>(c.y * by), static_cast<float>(c.z * by)}; }
Float3 grey(double value) { return by_factor(all_of_it, value); }

// GGX alpha that can be computed with; the smoothest of glossy surfaces.
constexpr double smoothest = 1e-3;

std::array<const GltfTextureUse*, 10> textures_of(const GltfMaterial& m) {
    return {&m.base_texture,           &m.metallic_roughness_texture,
            &m.normal_texture,         &m.specular_texture,
            &m.specular_color_texture, &m.transmission_texture,
            &m.coat_texture,           &m.emission_texture,
            &m.coat_roughness_texture, m.specular_glossiness ? &m.specular_glossiness->texture : &m.base_texture};
}

}  // namespace

const GltfMaterial& GltfMaterials::material(int64_t number) {
    const auto [at, added] = read_.try_emplace(number);
    if (added) at->second = read_gltf_material(*model_, number);
    return at->second;
}

int64_t GltfMaterials::uv_set(int64_t number) {
    for (const GltfTextureUse* use : textures_of(material(number)))
        if (use->is_given()) return use->uv_set;
    return 0;
}

bool GltfMaterials::has_normal_map(int64_t number) { return material(number).normal_texture.is_given(); }

GltfSurface GltfMaterials::surface(int64_t number, const GltfSurfaceUse& use) {
    const bool plain = !use.colors.any || (use.colors.uniform && use.colors.mean == all_of_it);
    const std::tuple key(number, use.green_is_turned, use.colors.alpha);
    if (plain)
        if (const auto found = known_.find(key); found != known_.end()) return found->second;
    uv_set_ = uv_set(number);
    const GltfSurface made = make_surface(material(number), use);
    if (plain) known_.emplace(key, made);
    return made;
}

GltfSurface GltfMaterials::make_surface(const GltfMaterial& m, const GltfSurfaceUse& use) {
    GltfSurface surface;
    if (m.alpha == GltfMaterial::Alpha::mask && m.opacity < m.cutoff) {
        surface.invisible = true;
        return surface;
    }
    note_what_is_not_read(m);
    if (use.colors.any && use.colors.alpha && m.alpha != GltfMaterial::Alpha::opaque)
        notes_.add("vertex alpha", m.place, "the alpha of vertices (COLOR_0) is not read; its surfaces are as opaque as the material says");
    const bool varied = use.colors.any && !use.colors.uniform;
    if (varied && m.base_texture.is_given())
        notes_.add("vertex colors", m.place, "colours of vertices (COLOR_0) over a texture are not supported; their mean is used");
    else if (varied && m.metallic > 0.5)
        notes_.add("metal vertex colors", m.place,
                   "colours of vertices (COLOR_0) are those of matt surfaces alone; of this metal their mean is used");
    surface.vertex_colors = varied && !m.base_texture.is_given() && m.metallic <= 0.5;
    if (surface.vertex_colors) {
        notes_.add("matt vertex colors", m.place, "what has colours of vertices (COLOR_0) is matt, without highlights");
        surface.material = add(m, {diffuse_material(product(m.base, use.colors.mean)), {}});
    } else {
        surface.material = main_material(m, parts_of(m, use), use.green_is_turned);
    }
    surface.dark_material = surface.material;
    add_emission(m, surface);
    if (m.alpha == GltfMaterial::Alpha::opaque) return surface;
    surface.dark_material = cut_out(m, surface.material);
    const bool shines = surface.area_light || surface.glow;
    if (surface.dark_material != surface.material && shines)
        notes_.add("shining cut-out", m.place, "what shines is not cut out; its alpha is left out there");
    if (!shines) surface.material = surface.dark_material;
    return surface;
}

// What a texture says times the factor; the factor alone where it cannot be had.
Texture GltfMaterials::factor_texture(const GltfMaterial& m, const GltfTextureUse& use, GltfChannel channel, bool srgb, const Float3& factor) {
    if (use.is_given() && use.uv_set != uv_set_) {
        notes_.add("uv sets", m.place,
                   fmt::format("its textures use different sets of coordinates; those that use TEXCOORD_{} are left out", use.uv_set));
        return factor;
    }
    const auto found = textures_.texture(use, channel, srgb, factor);
    return found ? *found : Texture(factor);
}

GltfMaterials::Parts GltfMaterials::parts_of(const GltfMaterial& m, const GltfSurfaceUse& use) {
    Parts parts;
    const Float3 tint = use.colors.any ? use.colors.mean : all_of_it;
    parts.base = factor_texture(m, m.base_texture, GltfChannel::color, true, product(m.base, tint));
    if (m.specular_glossiness) {
        const auto& s = *m.specular_glossiness;
        const Texture rough = one_minus(factor_texture(m, s.texture, GltfChannel::alpha, true, grey(s.glossiness)));
        parts.metallic = Texture(0.0);
        parts.alpha = rough * rough;
        parts.straight = factor_texture(m, s.texture, GltfChannel::color, true, s.specular);
        return parts;
    }
    parts.metallic = factor_texture(m, m.metallic_roughness_texture, GltfChannel::blue, false, grey(m.metallic));
    const Texture rough = factor_texture(m, m.metallic_roughness_texture, GltfChannel::green, false, grey(m.roughness));
    parts.alpha = rough * rough;
    // An index of 0 stands for one that reflects everything.
    const double root = m.ior >= 1 ? (m.ior - 1) / (m.ior + 1) : m.ior == 0 ? 1 : 0.2;
    const Texture color = factor_texture(m, m.specular_color_texture, GltfChannel::color, true, by_factor(m.specular_color, root * root));
    parts.straight = color * factor_texture(m, m.specular_texture, GltfChannel::alpha, false, grey(m.specular));
    return parts;
}

uint32_t GltfMaterials::main_material(const GltfMaterial& m, const Parts& parts, bool green_is_turned) {
    if (m.unlit)
        return add(m, [&] {
            TexturedMaterial flat{diffuse_material(parts.base.mean()), {}};
            flat.set(RP_PARAMETER_COLOR, parts.base, flat.material.color);
            return flat;
        }());
    const Texture through = factor_texture(m, m.transmission_texture, GltfChannel::red, false, grey(m.transmission)) * one_minus(parts.metallic);
    const bool clear = !through.is_constant() || through.mean().x > 0;
    uint32_t result = 0;
    if (!clear)
        result = glossy(m, parts, green_is_turned);
    else if (m.thickness > 0)
        result = mixed_by(m, glossy(m, parts, green_is_turned), glass(m, parts, green_is_turned), through);
    else
        result = sheet(m, parts, through, green_is_turned);
    return m.coat > 0 ? under_coat(m, parts, result, green_is_turned) : result;
}

// Section 3.9.2 and appendix B of the specification: all of metals is in what they reflect straight.
uint32_t GltfMaterials::glossy(const GltfMaterial& m, const Parts& parts, bool green_is_turned) {
    const Texture color = parts.base * one_minus(parts.metallic), straight = mixed(parts.straight, parts.base, parts.metallic);
    const float alpha = parts.alpha.mean().x;
    TexturedMaterial result;
    const bool reflects = !straight.is_constant() || greatest(straight.mean()) > 0;
    if (!reflects)
        result.material = diffuse_material(color.mean());
    else if (parts.alpha.is_constant() && alpha < smoothest && straight.is_constant() && color.is_constant() && greatest(color.mean()) == 0)
        result.material = conductor_of_reflectance(straight.mean(), 0);  // a mirror
    else
        result.material = glossy_material(color.mean(), straight.mean(), alpha);
    result.set(RP_PARAMETER_COLOR, color, result.material.color);
    if (result.material.kind == RP_MATERIAL_LAYERED) {
        result.set(RP_PARAMETER_SPECULAR, straight, result.material.specular);
        if (!parts.alpha.is_constant()) result.textures.push_back({RP_PARAMETER_ALPHA, parts.alpha});
    } else if (result.material.kind == RP_MATERIAL_CONDUCTOR) {
        std::fill(std::begin(result.material.color), std::end(result.material.color), 1.0f);
    }
    add_normals(m, green_is_turned, result);
    return add(m, result);
}

// A solid that light goes through. What it takes away on its way is taken when light enters and when it leaves, as of the thickness that is given.
uint32_t GltfMaterials::glass(const GltfMaterial& m, const Parts& parts, bool green_is_turned) {
    Float3 tint = all_of_it;
    if (m.attenuation_distance > 0 && greatest(m.attenuation_color) < 1) {
        notes_.add("attenuation", m.place, "what a volume takes of light is that of its thickness (thicknessFactor), wherever light goes through");
        const double half_way = m.thickness / m.attenuation_distance / 2;
        const auto left = [&](float c) { return static_cast<float>(std::pow(std::max(double{c}, 1e-6), half_way)); };
        tint = {left(m.attenuation_color.x), left(m.attenuation_color.y), left(m.attenuation_color.z)};
    } else if (m.attenuation_distance > 0) {
        tint = m.attenuation_color;
    }
    const Texture refracted = parts.base * Texture(tint);
    const double ior = std::clamp(m.ior >= 1 ? m.ior : 1.5, 1.0001, 10.0);
    const float mean_alpha = parts.alpha.mean().x;
    const bool rough = !parts.alpha.is_constant() || mean_alpha > smoothest;
    const bool plain = !rough && refracted.is_constant() && refracted.mean() == all_of_it && !m.normal_texture.is_given();
    TexturedMaterial result;
    result.material = plain ? dielectric_material(static_cast<float>(ior))
                            : dielectric_material(static_cast<float>(ior), rough ? std::max(mean_alpha, static_cast<float>(smoothest)) : 0, all_of_it,
                                                  by_factor(refracted.mean(), refracted.mean() == all_of_it ? 0.999999 : 1));
    if (!plain) {
        result.set(RP_PARAMETER_REFRACTED, refracted, result.material.refracted);
        if (!parts.alpha.is_constant()) result.textures.push_back({RP_PARAMETER_ALPHA, parts.alpha});
    }
    add_normals(m, green_is_turned, result);
    return add(m, result);
}

// Without a thickness: a sheet, which light goes straight through.
uint32_t GltfMaterials::sheet(const GltfMaterial& m, const Parts& parts, const Texture& through, bool green_is_turned) {
    if (!parts.alpha.is_constant() || parts.alpha.mean().x > 0.01f)
        notes_.add("rough sheet", m.place,
                   "what goes through a thin surface (KHR_materials_transmission without a volume) is not blurred by its roughness");
    const Texture color = parts.base * one_minus(parts.metallic) * one_minus(through), straight = mixed(parts.straight, parts.base, parts.metallic);
    const Texture refracted = parts.base * through;
    TexturedMaterial result{glossy_material(color.mean(), straight.mean(), parts.alpha.mean().x), {}};
    rp_material& material = result.material;
    material.flags |= RP_MATERIAL_THIN | RP_MATERIAL_SMOOTH_REFRACTION;
    material.ior = static_cast<float>(std::clamp(m.ior >= 1 ? m.ior : 1.5, 1.0, 10.0));
    result.set(RP_PARAMETER_COLOR, color, material.color);
    result.set(RP_PARAMETER_SPECULAR, straight, material.specular);
    result.set(RP_PARAMETER_REFRACTED, refracted, material.refracted);
    if (!parts.alpha.is_constant()) result.textures.push_back({RP_PARAMETER_ALPHA, parts.alpha});
    add_normals(m, green_is_turned, result);
    return add(m, result);
}

// Under a coat of an index of 1.5, lacquer and what is under it reflect as one would expect of them: light goes through the coat and back.
uint32_t GltfMaterials::under_coat(const GltfMaterial& m, const Parts& parts, uint32_t bare, bool green_is_turned) {
    constexpr float coat_ior = 1.5f;
    const Texture rough = factor_texture(m, m.coat_roughness_texture, GltfChannel::green, false, grey(m.coat_roughness));
    const Texture alpha = rough * rough, amount = factor_texture(m, m.coat_texture, GltfChannel::red, false, grey(m.coat));
    const float mean_alpha = alpha.is_constant() && alpha.mean().x < smoothest ? 0 : std::max(alpha.mean().x, static_cast<float>(smoothest));
    const auto with_coat = [&](TexturedMaterial material) {
        if (!alpha.is_constant()) material.textures.push_back({RP_PARAMETER_ALPHA, alpha});
        add_normals(m, green_is_turned, material);
        return add(m, material);
    };
    const auto lacquer = [&] {
        TexturedMaterial matt{coated_diffuse_material(parts.base.mean(), coat_ior, mean_alpha), {}};
        matt.set(RP_PARAMETER_COLOR, parts.base, matt.material.color);
        return with_coat(std::move(matt));
    };
    const auto metal = [&] {
        const rp_material base = conductor_of_reflectance(parts.base.mean(), 0);
        TexturedMaterial coated{coated_conductor_material({base.eta[0], base.eta[1], base.eta[2]}, {base.k[0], base.k[1], base.k[2]},
                                                          std::max(parts.alpha.mean().x, static_cast<float>(smoothest)), coat_ior, mean_alpha),
                                {}};
        if (!parts.alpha.is_constant()) coated.textures.push_back({RP_PARAMETER_BASE_ALPHA, parts.alpha});
        if (!parts.base.is_constant())
            notes_.add("coated metal", m.place, "the texture of a metal under a clear coat is not supported; its mid value is used");
        return with_coat(std::move(coated));
    };
    const bool all_metal = parts.metallic.is_constant() && parts.metallic.mean().x >= 1;
    const bool no_metal = parts.metallic.is_constant() && parts.metallic.mean().x <= 0;
    uint32_t coated = 0;
    if (m.transmission > 0) {
        notes_.add("coated glass", m.place, "a clear coat over what light goes through is left out");
        return bare;
    }
    if (all_metal)
        coated = metal();
    else if (no_metal)
        coated = lacquer();
    else
        coated = mixed_by(m, lacquer(), metal(), parts.metallic);
    return mixed_by(m, bare, coated, amount);
}

uint32_t GltfMaterials::mixed_by(const GltfMaterial& m, uint32_t first, uint32_t second, const Texture& amount) {
    if (amount.is_constant() && amount.mean().x >= 1) return second;
    if (amount.is_constant() && amount.mean().x <= 0) return first;
    TexturedMaterial mix{mix_material(first, second, amount.mean_number()), {}};
    if (!amount.is_constant()) mix.textures.push_back({RP_PARAMETER_AMOUNT, amount});
    return add(m, mix);
}

// A mix with nothing. A mask is a ramp so steep that there is nothing between the alphas of a picture of 8 bits.
uint32_t GltfMaterials::cut_out(const GltfMaterial& m, uint32_t material) {
    Texture opacity = grey(m.opacity);
    if (textures_.has_alpha(m.base_texture)) opacity = factor_texture(m, m.base_texture, GltfChannel::alpha, true, grey(m.opacity));
    if (m.alpha == GltfMaterial::Alpha::mask) {
        if (opacity.is_constant()) return material;
        constexpr double steepness = 1024;
        const double begin = 0.5 - steepness * (m.cutoff - 0.5 / 255);
        opacity = mixed(Texture(begin), Texture(begin + steepness), opacity);
    }
    return mixed_by(m, RP_NONE, material, opacity);
}

// Green is towards the upper edge of the picture; where coordinates are mirrored, that is the other way round.
void GltfMaterials::add_normals(const GltfMaterial& m, bool green_is_turned, TexturedMaterial& to) {
    if (!m.normal_texture.is_given() || m.normal_texture.uv_set != uv_set_) return;
    const auto found = textures_.texture(m.normal_texture, GltfChannel::color, false, all_of_it);
    if (!found) return;
    Texture normals = *found;
    const auto scale = static_cast<float>(m.normal_scale);
    if (scale != 1) normals = mixed(Texture(Float3{0.5f, 0.5f, 0}), normals, Texture(Float3{scale, scale, 1}));
    if (green_is_turned) normals = mixed(normals, one_minus(normals), Texture(Float3{0, 1, 0}));
    to.textures.push_back({RP_PARAMETER_NORMAL, normals});
}

uint32_t GltfMaterials::add(const GltfMaterial& m, const TexturedMaterial& material) {
    if (!add_material(scene_, material))
        notes_.add("too many textures", m.place, "its textures are more than a path can keep; their mid values are used");
    return static_cast<uint32_t>(scene_.materials.size() - 1);
}

void GltfMaterials::add_emission(const GltfMaterial& m, GltfSurface& surface) {
    if (greatest(m.emission) <= 0 || m.unlit) return;
    surface.is_lamp = greatest(m.emission) > 1;
    if (m.emission_texture.is_given() && m.emission_texture.uv_set != uv_set_)
        notes_.add("emission uv set", m.place, "the image by which it shines uses another set of coordinates; it shines evenly");
    else if (m.emission_texture.is_given() && textures_.small_image(m.emission_texture))
        surface.glow = m.emission;
    if (!surface.glow) surface.area_light = add_light(m, m.emission);
}

std::optional<GltfSmallImage> GltfMaterials::glow_image(int64_t number) {
    const GltfMaterial& m = material(number);
    notes_.add("emission", m.place,
               "it shines by an image, which lights have not: each triangle shines evenly, in about the mean colour of the image there");
    return textures_.small_image(m.emission_texture);
}

uint32_t GltfMaterials::add_light(int64_t number, const Float3& radiance) { return add_light(material(number), radiance); }

uint32_t GltfMaterials::add_light(const GltfMaterial& m, const Float3& radiance) {
    scene_.area_lights.push_back({radiance, m.two_sided});
    return static_cast<uint32_t>(scene_.area_lights.size() - 1);
}

void GltfMaterials::note_what_is_not_read(const GltfMaterial& m) {
    if (m.unlit) notes_.add("unlit", m.place, "is to be shown without light (KHR_materials_unlit); it is matt, and lit as all else");
    if (m.specular > 0 && m.specular < 1) notes_.add("specular", m.place, "what it reflects at grazing angles is as if its specularFactor were 1");
    if (m.has_coat_normals && m.coat > 0)
        notes_.add("coat normals", m.place, "the normal map of its clear coat is left out; the coat follows that of the material");
    if (m.normal_texture.is_given() && m.normal_texture.uv_set != uv_set_)
        notes_.add("normal uv set", m.place, "its normal map uses another set of coordinates than its other textures; it is left out");
}

}  // namespace raypager
