#include "procedural/island_land.hpp"

#include <algorithm>
#include <cmath>

#include "base/parallel.hpp"
#include "procedural/noise.hpp"

namespace raypager {
namespace {

constexpr double tightness = 0.12;   // of the lines near the eye
constexpr double beach_slope = 0.1;  // metres up for each metre inland

// In the plane, of length 1; anything at the origin.
Vector direction_of(double x, double z) {
    const double r = std::sqrt(x * x + z * z);
    return r > 1e-9 ? Vector{x / r, 0, z / r} : Vector{0, 0, 1};
}

}  // namespace

IslandLand::IslandLand(double radius, uint64_t quads, uint64_t seed)
    : radius_(radius), beach_(std::clamp(0.045 * radius, 6.0, 30.0)), seed_(mix_bits(seed + 3)) {
    const double shore = coast(0, 1);
    bay_ = {0, 0, shore};
    eye_ = {0, 3.2, shore + std::clamp(0.085 * radius, 10.0, 45.0)};
    axis_x_ = {-half(), half(), eye_[0], tightness};
    axis_z_ = {-half(), half(), bay_[2], tightness};
    x_ = axis_x_.lines(quads);
    z_ = axis_z_.lines(quads);
    heights_.resize(x_.size() * z_.size());
    parallel_for(z_.size(), 4, [&](size_t begin, size_t end) {
        for (size_t r = begin; r < end; r++)
            for (size_t c = 0; c < x_.size(); c++) heights_[index(c, r)] = static_cast<float>(height(x_[c], z_[r]));
    });
}

double IslandLand::coast(double x, double z) const {
    const Vector d = direction_of(x, z);
    const double wander = 0.17 * fractal_noise(d * 1.4, 3, 0.5, seed_) + 0.03 * fractal_noise(d * 7.0, 3, 0.5, seed_ + 7);
    return radius_ * (0.9 + wander - 0.2 * smooth_step(0.8, 1, d[2]));
}

double IslandLand::inland(double x, double z) const { return coast(x, z) - std::sqrt(x * x + z * z); }

// A cone with gullies that run down from its top, 1 high, 0 beyond its reach.
double IslandLand::volcano(double x, double z, const Vector& middle, double reach, uint64_t seed) const {
    const double u = x - middle[0], w = z - middle[2], r = std::sqrt(u * u + w * w) / reach;
    if (r >= 1) return 0;
    const Vector d = direction_of(u, w);
    const double ridges = ridged_noise({d[0] * 2.1 + 3, r * 1.1, d[2] * 2.1}, 4, 0.5, seed_ + seed);
    const double crags = fractal_noise({u / (0.2 * reach), 0.4, w / (0.2 * reach)}, 5, 0.5, seed_ + seed + 11);
    const double t = 1 - r;
    const double cone = t * (0.25 + 0.75 * t);
    return std::max(0.0, cone * (1 - 0.75 * smooth_step(0, 0.3, r) * (1 - ridges)) + 0.16 * t * crags);
}

double IslandLand::height(double x, double z) const {
    const double d = inland(x, z);
    if (d < 0) {
        const double outside = smooth_step(0.05 * radius_, 0.3 * radius_, -d);
        return -std::min(0.07 * -d, 2.5) - 0.04 * radius_ * outside;
    }
    const double dunes = 0.3 * fractal_noise({x / 9, 0.2, z / 9}, 3, 0.5, seed_ + 41) * smooth_step(0, 0.5 * beach_, d);
    const double plain = 0.035 * std::max(0.0, d - beach_) * (1 + 0.8 * fractal_noise({x / 70, 0.6, z / 70}, 4, 0.5, seed_ + 51));
    const double high = std::min(0.5 * radius_, 1300.0), second = 0.45 * high;
    const double rise = smooth_step(beach_, 0.4 * radius_, d);
    const double first_cone = volcano(x, z, {-0.12 * radius_, 0, -0.12 * radius_}, 0.95 * radius_, 100);
    const double second_cone = volcano(x, z, {0.42 * radius_, 0, 0.02 * radius_}, 0.5 * radius_, 200);
    return beach_slope * std::min(d, beach_) + dunes + plain + rise * (high * first_cone + second * second_cone);
}

GridMesh IslandLand::mesh() const {
    return {x_, z_, [this](size_t column, size_t row) { return double{heights_[index(column, row)]}; }, eye_};
}

IslandLand::Footing IslandLand::footing(double x, double z) const {
    const auto cell = [](const std::vector<double>& lines, double place) {
        const auto above = std::upper_bound(lines.begin(), lines.end(), place);
        return std::clamp<size_t>(static_cast<size_t>(above - lines.begin()), 1, lines.size() - 1) - 1;
    };
    const size_t c = cell(x_, x), r = cell(z_, z);
    const double width = x_[c + 1] - x_[c], depth = z_[r + 1] - z_[r];
    const double u = std::clamp((x - x_[c]) / width, 0.0, 1.0), v = std::clamp((z - z_[r]) / depth, 0.0, 1.0);
    const double b = heights_[index(c + 1, r)], d = heights_[index(c, r + 1)];
    const bool first = u + v <= 1;  // of the two triangles of the quad
    const double corner = first ? heights_[index(c, r)] : heights_[index(c + 1, r + 1)];
    const double along_x = first ? b - corner : corner - d, along_z = first ? d - corner : corner - b;
    const double height = first ? corner + along_x * u + along_z * v : corner - along_x * (1 - u) - along_z * (1 - v);
    return {height, unit({-along_x / width, 1, -along_z / depth})};
}

}  // namespace raypager
