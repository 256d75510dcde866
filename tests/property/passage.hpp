// Where a ray is inside a box: the truth that the box tests of the kernels are compared with.
#pragma once

#include <algorithm>
#include <cmath>

#include "raypager/scene.hpp"
#include "scene/box.hpp"

namespace raypager {

// None if it is left before it is entered.
struct Passage {
    double entry, exit;
};

// Exact bounds of the ray inside the box, in double: the truth for float inputs up to 1e-13. origin, direction: three numbers each.
inline Passage exact_passage(const float* origin, const float* direction, const Box& box) {
    Passage result = {0, INFINITY};
    for (int k = 0; k < 3; k++) {
        const double o = origin[k], d = direction[k];
        if (d == 0) {
            if (o < box.lower[k] || o > box.upper[k]) return {1, 0};
            continue;
        }
        const double a = (box.lower[k] - o) / d, b = (box.upper[k] - o) / d;
        result.entry = std::max(result.entry, std::min(a, b));
        result.exit = std::min(result.exit, std::max(a, b));
    }
    return result;
}

}  // namespace raypager
