// Makes the records of instances, and says what they cover.
#pragma once

#include <array>
#include <optional>

#include "raypager/abi/instance.h"
#include "raypager/scene.hpp"
#include "scene/box.hpp"

namespace raypager {

// The middle of an object's box, as kernels have it: floats.
std::array<double, 3> middle_of(const Box& object_box);

// object_box: of the object, in its own space. Nothing if the transform flattens the object, is not affine, or if its numbers are beyond what floats
// hold exactly enough (1e-6 to 1e6 as scales are). path and object are left 0.
std::optional<rp_instance> make_instance(const Transform& to_world, const Box& object_box);

// Where the record puts the object, not where the transform did that it was made of: its numbers are rounded.
Transform placement_of(const rp_instance& instance, const Box& object_box);

// Bounds in the world of all that rays can meet of the instance.
Box bounds_of(const rp_instance& instance, const Box& object_box);

}  // namespace raypager
