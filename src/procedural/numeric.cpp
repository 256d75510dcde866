#include "procedural/numeric.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace raypager {
namespace {

// coefficients[0] + coefficients[1] y + ... by Horner's rule.
template <size_t count>
double polynomial(const double (&coefficients)[count], double y) {
    double sum = coefficients[count - 1];
    for (size_t i = count - 1; i-- > 0;) sum = sum * y + coefficients[i];
    return sum;
}

}  // namespace

double Random::bell() {
    // Twelve uniform numbers have variance 1 together; squeezing the tails costs nothing that a picture shows.
    double sum = -6;
    for (int i = 0; i < 12; i++) sum += uniform();
    return std::clamp(sum, -3.5, 3.5);
}

Vector Random::direction() {
    const double z = uniform(-1, 1);
    const SinCos angle = sincos_turns(uniform());
    const double r = std::sqrt(std::max(0.0, 1 - z * z));
    return {r * angle.cos, r * angle.sin, z};
}

SinCos sincos_turns(double turns) {
    // To [-1/8, 1/8] turns about the nearest quarter, then Taylor series; the first terms left out are below 1e-16.
    const double quarter = std::floor(turns * 4 + 0.5);
    const double x = (turns - quarter * 0.25) * 6.283185307179586;
    const double s =
        x * polynomial({1, -1.0 / 6, 1.0 / 120, -1.0 / 5040, 1.0 / 362880, -1.0 / 39916800, 1.0 / 6227020800, -1.0 / 1307674368000}, x * x);
    const double c = polynomial(
        {1, -1.0 / 2, 1.0 / 24, -1.0 / 720, 1.0 / 40320, -1.0 / 3628800, 1.0 / 479001600, -1.0 / 87178291200, 1.0 / 20922789888000}, x * x);
    switch (static_cast<int64_t>(quarter) & 3) {
        case 0:
            return {s, c};
        case 1:
            return {c, -s};
        case 2:
            return {-s, -c};
        default:
            return {-c, s};
    }
}

double smooth_step(double low, double high, double x) {
    const double t = std::clamp((x - low) / (high - low), 0.0, 1.0);
    return t * t * (3 - 2 * t);
}

}  // namespace raypager
