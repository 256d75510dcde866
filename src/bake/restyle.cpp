#include "bake/restyle.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>

#include "bake/paged_sky.hpp"
#include "bake/used_images.hpp"
#include "gather/lights.hpp"
#include "scene/light_images.hpp"
#include "store/check_images.hpp"

namespace raypager {
namespace {

uint32_t area_light_of(const rp_primitive_range& range) { return range.flags >> RP_RANGE_AREA_LIGHT_SHIFT; }

bool all_lights_known(const Scene& scene, const BakedScene& baked) {
    return std::ranges::all_of(baked.ranges, [&](const rp_primitive_range& range) {
        return range.first_light == RP_NONE || (area_light_of(range) < RP_RANGE_AREA_LIGHTS && area_light_of(range) < scene.area_lights.size());
    });
}

// Primitives that shine come first; none of objects does, and theirs are numbered behind all others. Where they are and how large stays; how they
// shine is set anew.
Result<std::vector<rp_light>> lights_of(const Scene& scene, const BakedScene& baked) {
    std::vector<rp_light> lights;
    for (size_t i = 0; i < baked.ranges.size(); i++) {
        const rp_primitive_range& range = baked.ranges[i];
        if (range.first_light == RP_NONE) continue;
        const uint64_t end = i + 1 < baked.ranges.size() ? baked.ranges[i + 1].first_primitive : baked.triangles + baked.spheres;
        const AreaLight& area = scene.area_lights[area_light_of(range)];
        const auto first = baked.lights.begin() + range.first_light;
        for (auto light = first; light != first + static_cast<ptrdiff_t>(end - range.first_primitive); ++light)
            lights.push_back(shining_as(*light, area));
    }
    MeshIssues told_when_baked;
    for (const Shape& shape : scene.shapes)
        if (shape.unseen && shape.area_light && !is_black(scene.area_lights[*shape.area_light]))
            RAYPAGER_TRY(add_unseen_lights(shape, scene.area_lights[*shape.area_light], lights, told_when_baked));
    lights.insert(lights.end(), scene.lights.begin(), scene.lights.end());
    return lights;
}

// But for their probabilities, which follow from the rest.
bool same_lights(const std::vector<rp_light>& a, const std::vector<rp_light>& b) {
    return std::ranges::equal(a, b, [](rp_light x, rp_light y) {
        x.probability = y.probability = 0;
        using Bits = std::array<std::byte, sizeof(rp_light)>;
        return std::bit_cast<Bits>(x) == std::bit_cast<Bits>(y);
    });
}

// Objects that no instance places are nowhere in the world.
bool is_empty(const BakedScene& baked) {
    if (baked.triangles + baked.spheres == 0) return true;
    return !baked.objects.empty() && baked.instances == 0 && std::ranges::equal(baked.lower, baked.upper);
}

}  // namespace

void take_settings(const Scene& scene, BakedScene& baked) {
    baked.camera = scene.camera;
    baked.width = scene.width;
    baked.height = scene.height;
    baked.spp = scene.spp;
    baked.max_depth = scene.max_depth;
    baked.film = scene.film;
    baked.filter = scene.filter;
    baked.materials = scene.materials;
    baked.light_images = scene.light_images;
    baked.texture_ops = baked_texture_ops(scene);
    baked.texture_maps = scene.texture_maps;
}

Result<bool> restyle(const Scene& scene, BakedScene& baked) {
    if (!all_lights_known(scene, baked)) return false;
    auto lights = lights_of(scene, baked);
    if (!lights) return lights.status();
    BakedScene textured;
    textured.images = baked.images;
    take_settings(scene, textured);
    RAYPAGER_TRY(check_programs(textured).at("textures"));
    const std::optional<uint32_t> sky = sky_image(scene.lights);
    const bool same_sky = sky && baked.has_paged_sky() && scene.light_images[*sky]->width == baked.sky_words[RP_IMAGE_WIDTH];
    if (baked.has_paged_sky() && !same_sky) return false;
    take_settings(scene, baked);
    if (baked.has_paged_sky()) leave_out_sky(baked.light_images, *sky);
    if (same_lights(*lights, baked.lights)) return true;
    baked.lights = std::move(*lights);
    set_probabilities(baked.lights, is_empty(baked) ? radius_of_nothing : radius_of(baked.lower, baked.upper));
    return true;
}

}  // namespace raypager
