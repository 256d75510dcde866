// Axis-aligned boxes of four floats a corner, which builders grow.
#pragma once

#include <algorithm>
#include <cstring>
#include <limits>

#include "scene/box.hpp"

namespace raypager {

// Four floats that are added, compared and chosen from at once: three axes, and one that holds anything.
using Float4 = float __attribute__((vector_size(16)));
using Int4 = int __attribute__((vector_size(16)));

inline Float4 least(Float4 a, Float4 b) { return a < b ? a : b; }
inline Float4 greatest(Float4 a, Float4 b) { return a > b ? a : b; }

// A box that grows fast.
struct Box4 {
    Float4 lower = {inf, inf, inf, inf}, upper = {-inf, -inf, -inf, -inf};

    void grow(const Box4& other) {
        lower = least(other.lower, lower);
        upper = greatest(other.upper, upper);
    }
    void grow(Float4 point) {
        lower = least(point, lower);
        upper = greatest(point, upper);
    }
    bool empty() const { return !(lower[0] <= upper[0]); }
    double half_area() const {
        if (empty()) return 0;
        const double x = double(upper[0]) - lower[0], y = double(upper[1]) - lower[1], z = double(upper[2]) - lower[2];
        return x * y + y * z + z * x;
    }
    // The same in single precision, of a box that is not empty: what compares areas by the million. Infinite or 0 where it leaves the floats.
    float rough_half_area() const {
        const Float4 size = upper - lower, product = size * __builtin_shufflevector(size, size, 1, 2, 0, 3);
        return product[0] + product[1] + product[2];
    }
    Box box() const {
        Box result;
        std::memcpy(result.lower, &lower, sizeof result.lower);
        std::memcpy(result.upper, &upper, sizeof result.upper);
        return result;
    }

private:
    static constexpr float inf = std::numeric_limits<float>::infinity();
};

}  // namespace raypager
