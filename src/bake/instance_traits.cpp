#include "bake/instance_traits.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "gather/lights.hpp"
#include "scene/check_material.hpp"
#include "scene/emitters.hpp"
#include "scene/texture_use.hpp"
#include "world/placement.hpp"

namespace raypager {
namespace {

Float3 to_float(const std::array<double, 3>& p) { return {static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])}; }

double determinant(const Transform& t) {
    const auto& m = t.m;
    return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
           m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
}

bool in_range(const rp_light& light) {
    const auto at = [&](int edges) {
        return Float3{light.p[0] + (edges & 1 ? light.e1[0] : 0) + (edges & 2 ? light.e2[0] : 0),
                      light.p[1] + (edges & 1 ? light.e1[1] : 0) + (edges & 2 ? light.e2[1] : 0),
                      light.p[2] + (edges & 1 ? light.e1[2] : 0) + (edges & 2 ? light.e2[2] : 0)};
    };
    return raypager::in_range(at(0)) && raypager::in_range(at(1)) && raypager::in_range(at(2)) && std::isfinite(light.area);
}

}  // namespace

Status add_unseen_lights(const Scene& scene, std::span<const Shape> shapes, ObjectLights& object, MeshIssues& issues) {
    for (const Shape& shape : shapes) {
        if (!shape.unseen || !shape.area_light || is_black(scene.area_lights[*shape.area_light])) continue;
        RAYPAGER_TRY(add_unseen_lights(shape, scene.area_lights[*shape.area_light], object.lights, issues));
        object.area_lights.resize(object.lights.size(), *shape.area_light);
    }
    return {};
}

rp_light placed_light(const rp_light& light, const AreaLight& area, const Transform& to_world) {
    const auto point = [&](const float(&edge)[3], double times) {
        return to_float(to_world.point(light.p[0] + times * edge[0], light.p[1] + times * edge[1], light.p[2] + times * edge[2]));
    };
    rp_light placed;
    if (light.kind == RP_LIGHT_SPHERE) {
        placed = sphere_light(point(light.e1, 0), static_cast<float>(light.e1[0] * std::cbrt(std::abs(determinant(to_world)))), area);
    } else {
        const Float3 b = point(light.e1, 1), c = point(light.e2, 1);
        const bool flips = to_world.swaps_handedness();
        placed = triangle_light(point(light.e1, 0), flips ? c : b, flips ? b : c, area);
    }
    return light.flags & RP_LIGHT_UNSEEN ? unseen(placed) : placed;
}

ObjectLights lights_of_primitives(const Gathered& object) {
    ObjectLights lights{object.lights, std::vector<uint32_t>(object.lights.size())};
    for (size_t i = 0; i < object.ranges.size(); i++) {
        const rp_primitive_range& range = object.ranges[i];
        if (range.first_light == RP_NONE) continue;
        const uint64_t end = i + 1 < object.ranges.size() ? object.ranges[i + 1].first_primitive : object.triangles + object.spheres;
        std::fill_n(lights.area_lights.begin() + range.first_light, end - range.first_primitive, range.flags >> RP_RANGE_AREA_LIGHT_SHIFT);
    }
    return lights;
}

std::vector<Shape> seen_shapes(const Scene& scene, uint32_t object) {
    std::vector<Shape> shapes = scene.objects[object].shapes;
    std::erase_if(shapes, [](const Shape& shape) { return shape.unseen; });
    if (keeps_uvs(scene, object))
        for (Shape& shape : shapes) shape.keep_uvs = true;
    return shapes;
}

bool keeps_uvs(const Scene& scene, uint32_t object) {
    for (const auto& source : scene.instances)
        for (const ObjectMaterial& put : source->materials())
            if (put.object == object && uses_uvs(scene, put.material)) return true;
    return false;
}

InstanceTraits::InstanceTraits(const Scene& scene, std::span<const ObjectLights> lights, std::span<const uint32_t> first_ranges, size_t first_light)
    : scene_(scene),
      objects_(lights),
      first_ranges_(first_ranges),
      first_light_(first_light),
      materials_(scene.objects.size()),
      cut_out_(scene.objects.size()) {
    for (const auto& source : scene.instances)
        for (const ObjectMaterial& put : source->materials()) materials_[put.object].push_back(put.material);
    for (std::vector<uint32_t>& materials : materials_) std::ranges::sort(materials);
}

Status InstanceTraits::check(const Placement& placement) const {
    for (const float part : {placement.color.x, placement.color.y, placement.color.z})
        if (!(part >= 0 && part <= 1)) return Status::failed("its colour must be from 0 to 1");
    if (placement.material == RP_NONE) return {};
    if (!std::ranges::binary_search(materials_[placement.object], placement.material))
        return Status::failed(
            fmt::format("material {} of object {} is not among those that its source says it has", placement.material, placement.object));
    if (!objects_[placement.object].lights.empty() && may_be_nothing(scene_.materials, placement.material))
        return Status::failed(fmt::format("what shines cannot be cut out, as material {} is; give it another material", placement.material));
    return {};
}

Status InstanceTraits::add_lights(const Placement& placement, const Transform& to_world, rp_instance_traits& traits) {
    const ObjectLights& object = objects_[placement.object];
    if (lights_.size() + object.lights.size() > max_lights)
        return Status::failed(fmt::format("more than {} lights in instances; give what shines coarser meshes, or fewer instances", max_lights));
    traits.first_light = static_cast<rp_u32>(first_light_ + lights_.size());
    traits.light_count = static_cast<rp_u32>(object.lights.size());
    traits.object = placement.object;
    const bool stretched = !to_world.is_similarity(1e-3);  // as for spheres that are placed once
    for (size_t i = 0; i < object.lights.size(); i++) {
        if (stretched && object.lights[i].kind == RP_LIGHT_SPHERE)
            return Status::failed("it stretches a sphere that shines, or a point that does; give these as meshes");
        lights_.push_back(placed_light(object.lights[i], scene_.area_lights[object.area_lights[i]], to_world));
        if (!in_range(lights_.back())) return Status::failed(fmt::format("what shines there is beyond {}; scale the scene", largest_coordinate));
    }
    return {};
}

Result<uint32_t> InstanceTraits::add(const Placement& placement, const Transform& to_world) {
    const bool shines = !objects_[placement.object].lights.empty();
    if (!shines && placement.material == RP_NONE && placement.color == Float3{1, 1, 1}) return 0u;
    if (auto status = check(placement); !status.ok()) return status;
    const Look look = {placement.material, placement.color.x, placement.color.y, placement.color.z};
    if (!shines)
        if (const auto found = numbers_.find(look); found != numbers_.end()) return found->second;
    if (traits_.size() >= RP_MAX_INSTANCE_TRAITS)
        return Status::failed(
            fmt::format("more than {} instances that shine or materials and colours of instances; leave some out", RP_MAX_INSTANCE_TRAITS));
    rp_instance_traits traits = {{placement.color.x, placement.color.y, placement.color.z}, placement.material, RP_NONE, 0, RP_NONE, 0};
    if (shines)
        if (auto status = add_lights(placement, to_world, traits); !status.ok()) return status;
    traits_.push_back(traits);
    const auto number = static_cast<uint32_t>(traits_.size());
    if (!shines) numbers_.emplace(look, number);
    if (placement.material != RP_NONE && may_be_nothing(scene_.materials, placement.material)) cut_out_[placement.object] = true;
    return number;
}

void InstanceTraits::finish(BakedScene& baked) {
    baked.lights.insert(baked.lights.end(), lights_.begin(), lights_.end());
    lights_ = {};
    baked.instance_traits = std::move(traits_);
    for (size_t i = 0; i < first_ranges_.size(); i++) {
        if (!cut_out_[i]) continue;
        const size_t end = i + 1 < first_ranges_.size() ? first_ranges_[i + 1] : baked.ranges.size();
        for (size_t k = first_ranges_[i]; k < end; k++) baked.ranges[k].flags |= RP_RANGE_CUTOUT;
    }
}

}  // namespace raypager
