// Makes the records of instances, and says what they cover.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "raypager/abi/instance.h"
#include "raypager/scene.hpp"
#include "scene/box.hpp"

namespace raypager {

// The middle of an object's box, as kernels have it: floats.
std::array<double, 3> middle_of(const Box& object_box);

// object_box: of the object, in its own space. Nothing if the transform flattens the object, is not affine, or if its numbers are beyond what floats
// hold exactly enough (1e-6 to 1e6 as scales are). path and object are left 0.
std::optional<rp_instance> make_instance(const Transform& to_world, const Box& object_box);

// A record, and where it puts the object: placement_of(record).
struct PlacedInstance {
    rp_instance record;
    Transform placement;
};
// make_instance() for those who need the placement as well.
std::optional<PlacedInstance> place_instance(const Transform& to_world, const Box& object_box);

// Where the record puts the object, not where the transform did that it was made of: its numbers are rounded.
Transform placement_of(const rp_instance& instance, const Box& object_box);

// What is known of where an object is, in its own space.
struct ObjectBounds {
    Box box;
    // Boxes that hold all of it together: what is turned covers less of the world by these than by one. At most max_parts.
    std::vector<Box> parts;
    static constexpr size_t max_parts = 16;
};

// Bounds in the world of all that rays can meet of the instance. object: of which the record was made.
Box bounds_of(const rp_instance& instance, const ObjectBounds& object);
Box bounds_of(const PlacedInstance& placed, const ObjectBounds& object);

}  // namespace raypager
