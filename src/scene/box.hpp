// Axis-aligned boxes in single precision.
#pragma once

#include <algorithm>
#include <limits>

#include "raypager/scene.hpp"

namespace raypager {

struct Box {
    float lower[3] = {inf, inf, inf};
    float upper[3] = {-inf, -inf, -inf};

    void grow(const Box& other) {
        for (int a = 0; a < 3; a++) {
            lower[a] = std::min(lower[a], other.lower[a]);
            upper[a] = std::max(upper[a], other.upper[a]);
        }
    }
    void grow(const Float3& point) {
        const float p[3] = {point.x, point.y, point.z};
        for (int a = 0; a < 3; a++) {
            lower[a] = std::min(lower[a], p[a]);
            upper[a] = std::max(upper[a], p[a]);
        }
    }
    bool empty() const { return !(lower[0] <= upper[0]); }
    // Half the surface; 0 if empty.
    double half_area() const {
        if (empty()) return 0;
        const double x = double(upper[0]) - lower[0], y = double(upper[1]) - lower[1], z = double(upper[2]) - lower[2];
        return x * y + y * z + z * x;
    }

private:
    static constexpr float inf = std::numeric_limits<float>::infinity();
};

}  // namespace raypager
