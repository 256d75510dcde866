// A placement as a transform.
#pragma once

#include <algorithm>

#include "raypager/scene.hpp"

namespace raypager {

inline Transform transform_of(const Placement& placement) {
    Transform transform;
    std::copy(placement.to_world.begin(), placement.to_world.end(), transform.m.begin());
    return transform;
}

}  // namespace raypager
