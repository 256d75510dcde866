#include "bench/clock_model.hpp"

#include <array>
#include <bit>
#include <cmath>
#include <optional>

namespace raypager::bench {
namespace {

constexpr size_t costs = 3;
using Vector3 = std::array<double, costs>;

// Each in units of its own, so that the three are of one size. Divided by the seconds, for errors in proportion.
struct Equations {
    std::array<Vector3, costs> matrix = {};
    Vector3 right = {};
    double count = 0;
};

// Gauss, for the costs in `chosen`; none if they cannot be told apart.
std::optional<Vector3> solve(const Equations& e, unsigned chosen) {
    std::array<std::array<double, costs + 1>, costs> rows = {};
    for (size_t i = 0; i < costs; i++)
        for (size_t j = 0; j < costs; j++) rows[i][j] = (chosen >> i & 1) && (chosen >> j & 1) ? e.matrix[i][j] : i == j ? 1 : 0;
    for (size_t i = 0; i < costs; i++) rows[i][costs] = chosen >> i & 1 ? e.right[i] : 0;
    for (size_t i = 0; i < costs; i++) {
        // The matrix is positive semidefinite: what is left of the diagonal says whether a row is a combination of those before it.
        if (rows[i][i] <= 1e-9 * (chosen >> i & 1 ? e.matrix[i][i] : 1)) return std::nullopt;
        for (size_t k = 0; k < costs; k++) {
            if (k == i) continue;
            const double f = rows[k][i] / rows[i][i];
            for (size_t j = i; j <= costs; j++) rows[k][j] -= f * rows[i][j];
        }
    }
    return Vector3{rows[0][costs] / rows[0][0], rows[1][costs] / rows[1][1], rows[2][costs] / rows[2][2]};
}

double squared_error(const Equations& e, const Vector3& x) {
    double error = e.count;
    for (size_t i = 0; i < costs; i++) {
        error -= 2 * x[i] * e.right[i];
        for (size_t j = 0; j < costs; j++) error += x[i] * x[j] * e.matrix[i][j];
    }
    return error;
}

}  // namespace

ClockModel fit_clock(std::span<const Extent> measured) {
    Vector3 unit = {};
    for (const Extent& extent : measured) {
        unit[0] += extent.rays, unit[1] += extent.rounds, unit[2] += extent.bytes;
    }
    Equations equations;
    for (const Extent& extent : measured) {
        if (!(extent.seconds > 0)) continue;
        Vector3 row = {extent.rays, extent.rounds, extent.bytes};
        for (size_t i = 0; i < costs; i++) row[i] = unit[i] > 0 ? row[i] / unit[i] / extent.seconds : 0;
        for (size_t i = 0; i < costs; i++) {
            for (size_t j = 0; j < costs; j++) equations.matrix[i][j] += row[i] * row[j];
            equations.right[i] += row[i];
        }
        equations.count++;
    }
    // Few enough to try which of them count. Fewer come first, and more must be better.
    Vector3 best = {};
    double least = equations.count;
    for (const unsigned chosen : {1u, 2u, 4u, 3u, 5u, 6u, 7u}) {
        if (std::popcount(chosen) > equations.count) continue;
        const auto x = solve(equations, chosen);
        if (!x || (*x)[0] < 0 || (*x)[1] < 0 || (*x)[2] < 0) continue;
        const double error = squared_error(equations, *x);
        if (error < least - 1e-9 * equations.count) best = *x, least = error;
    }
    const auto cost = [&](size_t i) { return unit[i] > 0 ? best[i] / unit[i] : 0; };
    return {cost(0), cost(1), cost(2)};
}

}  // namespace raypager::bench
