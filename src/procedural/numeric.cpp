#include "procedural/numeric.hpp"

#include <algorithm>
#include <cmath>

namespace raypager {

double length(const Double3& a) { return std::sqrt(dot(a, a)); }

Double3 normalized(const Double3& a) { return a * (1 / length(a)); }

double Random::bell() {
    // Twelve uniform numbers have variance 1 together; squeezing the tails costs nothing that a picture shows.
    double sum = -6;
    for (int i = 0; i < 12; i++) sum += uniform();
    return std::clamp(sum, -3.5, 3.5);
}

Double3 Random::direction() {
    const double z = uniform(-1, 1);
    const SinCos angle = sincos_turns(uniform());
    const double r = std::sqrt(std::max(0.0, 1 - z * z));
    return {r * angle.cos, r * angle.sin, z};
}

SinCos sincos_turns(double turns) {
    // To [-1/8, 1/8] turns about the nearest quarter, then Taylor series; the terms left out are below 1e-16.
    const double quarter = std::floor(turns * 4 + 0.5);
    const double x = (turns - quarter * 0.25) * 6.283185307179586;
    const double y = x * x;
    const double s = x * (1 + y * (-1.0 / 6 + y * (1.0 / 120 + y * (-1.0 / 5040 + y * (1.0 / 362880 + y * (-1.0 / 39916800 + y / 6227020800.0))))));
    const double c =
        1 + y * (-1.0 / 2 + y * (1.0 / 24 + y * (-1.0 / 720 + y * (1.0 / 40320 + y * (-1.0 / 3628800 + y * (1.0 / 479001600 - y / 87178291200.0))))));
    switch (static_cast<int64_t>(quarter) & 3) {
        case 0: return {s, c};
        case 1: return {c, -s};
        case 2: return {-s, -c};
        default: return {-c, s};
    }
}

double smooth_step(double low, double high, double x) {
    const double t = std::clamp((x - low) / (high - low), 0.0, 1.0);
    return t * t * (3 - 2 * t);
}

}  // namespace raypager
