#include "bake/restyle.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <map>

#include "bake/instance_traits.hpp"
#include "bake/paged_sky.hpp"
#include "bake/used_images.hpp"
#include "gather/lights.hpp"
#include "scene/emitters.hpp"
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

// Which area light each light of an object has.
Result<std::vector<uint32_t>> area_lights_of(const Scene& scene, const BakedScene& baked, uint32_t object) {
    ObjectLights lights;
    for (const rp_primitive_range& range : baked.ranges_of_object(object))
        if (range.first_light != RP_NONE)
            lights.area_lights.insert(lights.area_lights.end(),
                                      baked.end_of_range(static_cast<size_t>(&range - baked.ranges.data())) - range.first_primitive,
                                      area_light_of(range));
    lights.lights.resize(lights.area_lights.size());
    MeshIssues told_when_baked;
    if (auto status = add_unseen_lights(scene, scene.objects[object].shapes, lights, told_when_baked); !status.ok()) return status;
    return std::move(lights.area_lights);
}

// Those of instances come last. first_lights: gets where those of each traits begin.
Status add_lights_of_instances(const Scene& scene, const BakedScene& baked, std::vector<rp_light>& lights, std::vector<rp_u32>& first_lights) {
    std::map<uint32_t, std::vector<uint32_t>> area_lights;  // of objects
    for (const rp_instance_traits& traits : baked.instance_traits) {
        first_lights.push_back(traits.first_light == RP_NONE ? RP_NONE : static_cast<rp_u32>(lights.size()));
        if (traits.first_light == RP_NONE) continue;
        const auto [at, added] = area_lights.try_emplace(traits.object);
        if (added) {
            auto found = area_lights_of(scene, baked, traits.object);
            if (!found) return found.status();
            at->second = std::move(*found);
        }
        if (at->second.size() != traits.light_count)
            return Status::failed("the lights of objects are not those that were baked; bake the scene again");
        for (uint32_t i = 0; i < traits.light_count; i++) {
            const rp_light& old = baked.lights[traits.first_light + i];
            const rp_light light = shining_as(old, scene.area_lights[at->second[i]]);
            lights.push_back(old.flags & RP_LIGHT_UNSEEN ? unseen(light) : light);
        }
    }
    return {};
}

// Primitives that shine come first. Where they are and how large stays; how they shine is set anew.
Result<std::vector<rp_light>> lights_of(const Scene& scene, const BakedScene& baked) {
    std::vector<rp_light> lights;
    for (size_t i = 0; i < baked.own_range_count(); i++) {
        const rp_primitive_range& range = baked.ranges[i];
        if (range.first_light == RP_NONE) continue;
        const AreaLight& area = scene.area_lights[area_light_of(range)];
        const auto first = baked.lights.begin() + range.first_light;
        for (auto light = first; light != first + static_cast<ptrdiff_t>(baked.end_of_range(i) - range.first_primitive); ++light)
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
    std::vector<rp_u32> first_lights;
    RAYPAGER_TRY(add_lights_of_instances(scene, baked, *lights, first_lights));
    BakedScene textured;
    textured.images = baked.images;
    take_settings(scene, textured);
    RAYPAGER_TRY(check_programs(textured).at("textures"));
    const std::optional<uint32_t> sky = sky_image(scene.lights);
    const bool same_sky = sky && baked.has_paged_sky() && scene.light_images[*sky]->width == baked.sky_words[RP_IMAGE_WIDTH];
    if (baked.has_paged_sky() && !same_sky) return false;
    take_settings(scene, baked);
    if (baked.has_paged_sky()) leave_out_sky(baked.light_images, *sky);
    for (size_t i = 0; i < first_lights.size(); i++) baked.instance_traits[i].first_light = first_lights[i];
    if (same_lights(*lights, baked.lights)) return true;
    baked.lights = std::move(*lights);
    set_probabilities(baked.lights, is_empty(baked) ? radius_of_nothing : radius_of(baked.lower, baked.upper));
    return true;
}

}  // namespace raypager
