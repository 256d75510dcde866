// What some instances have of their own: the lights of an object that shines, in each place where it stands, another material, a colour.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <tuple>
#include <vector>

#include "block/baked_scene.hpp"
#include "gather/gather.hpp"
#include "raypager/abi/instance.h"
#include "raypager/scene.hpp"
#include "raypager/status.hpp"

namespace raypager {

// What shines of an object, in its own space: its primitives in the order of their ids, then what is not seen.
struct ObjectLights {
    std::vector<rp_light> lights;
    std::vector<uint32_t> area_lights;  // of each: index into Scene::area_lights
};

// Adds those of shapes that shine and are not seen.
Status add_unseen_lights(const Scene& scene, std::span<const Shape> shapes, ObjectLights& object, MeshIssues& issues);

// The light of an object where a transform puts it, shining on the side on which a copy would. Probability is left 0.
rp_light placed_light(const rp_light& light, const AreaLight& area, const Transform& to_world);

// Of an object that has been gathered.
ObjectLights lights_of_primitives(const Gathered& object);

// Shapes of an object without those that are not seen; with coordinates of textures also where only materials that instances put there read some.
std::vector<Shape> seen_shapes(const Scene& scene, uint32_t object);

// Whether any instance puts a material on an object that has a use for coordinates of textures.
bool keeps_uvs(const Scene& scene, uint32_t object);

class InstanceTraits {
public:
    static constexpr size_t max_lights = size_t{1} << 24;  // of all instances

    // lights, first_ranges: of each object. first_light: as many lights come before those of instances.
    InstanceTraits(const Scene& scene, std::span<const ObjectLights> lights, std::span<const uint32_t> first_ranges, size_t first_light);

    // Whether an instance has traits, as far as can be told without looking at them. REQUIRES: its object exists.
    bool may_have_any(const Placement& placement) const {
        return placement.material != RP_NONE || !(placement.color == Float3{1, 1, 1}) || !objects_[placement.object].lights.empty();
    }

    // The number of the traits of an instance, 0 if it has none. to_world: where its object is, as its record has it. An error says what is wrong
    // with the placement, or that there are too many.
    Result<uint32_t> add(const Placement& placement, const Transform& to_world);

    // All have been added: the traits and the lights, whose probabilities are still to be set, become those of the scene, and ranges know where
    // materials may be nothing.
    void finish(BakedScene& baked);

private:
    Status check(const Placement& placement) const;
    Status add_lights(const Placement& placement, const Transform& to_world, rp_instance_traits& traits);

    using Look = std::tuple<uint32_t, float, float, float>;  // material, colour
    const Scene& scene_;
    const std::span<const ObjectLights> objects_;
    const std::span<const uint32_t> first_ranges_;
    const size_t first_light_;
    std::vector<std::vector<uint32_t>> materials_;  // that may be put on each object
    std::vector<rp_instance_traits> traits_;
    std::vector<rp_light> lights_;
    std::map<Look, uint32_t> numbers_;  // of traits of what does not shine
    std::vector<bool> cut_out_;         // objects on which instances put materials of which parts may not be there
};

}  // namespace raypager
