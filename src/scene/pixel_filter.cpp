#include "scene/pixel_filter.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace raypager {
namespace {

// Wider ones would blur a picture until nothing is left of it; and sums over them stay accurate.
constexpr float largest_filter_radius = 64;

double radius_along(const PixelFilter& filter, uint32_t axis) { return axis == 0 ? filter.radius_x : filter.radius_y; }

double sinc(double x) { return std::abs(x) < 1e-5 ? 1 : std::sin(std::numbers::pi * x) / (std::numbers::pi * x); }

// Mitchell and Netravali 1988, "Reconstruction Filters in Computer Graphics"; from 0 to 2.
double mitchell(double x, double b, double c) {
    if (x <= 1) return ((12 - 9 * b - 6 * c) * x * x * x + (-18 + 12 * b + 6 * c) * x * x + (6 - 2 * b)) / 6;
    return ((-b - 6 * c) * x * x * x + (6 * b + 30 * c) * x * x + (-12 * b - 48 * c) * x + (8 * b + 24 * c)) / 6;
}

}  // namespace

double filter_weight(const PixelFilter& filter, uint32_t axis, double distance) {
    const double radius = radius_along(filter, axis), x = std::abs(distance), first = filter.first;
    if (!(x <= radius)) return 0;
    switch (filter.kind) {
        case PixelFilter::Kind::box:
            return 1;
        case PixelFilter::Kind::triangle:
            return 1 - x / radius;
        case PixelFilter::Kind::gaussian:
            return std::max(0.0, std::exp(-first * x * x) - std::exp(-first * radius * radius));
        case PixelFilter::Kind::mitchell:
            return std::max(0.0, mitchell(2 * x / radius, first, filter.second));
        case PixelFilter::Kind::sinc:
            return x < 1 ? std::max(0.0, sinc(x) * sinc(x / first)) : 0;
    }
    return 0;
}

bool has_negative_lobes(const PixelFilter& filter) {
    if (filter.kind == PixelFilter::Kind::sinc) return std::max(filter.radius_x, filter.radius_y) > 1;
    if (filter.kind != PixelFilter::Kind::mitchell) return false;
    for (int i = 0; i <= 200; i++)
        if (mitchell(0.01 * i, filter.first, filter.second) < -1e-6) return true;  // 0 at the border but for rounding
    return false;
}

std::vector<float> filter_shares(const PixelFilter& filter, uint32_t axis, uint32_t steps) {
    // By Simpson's rule, in pieces that are small beside any feature of these functions.
    constexpr uint32_t pieces = 32;
    const double piece = radius_along(filter, axis) / (steps * pieces);
    std::vector<double> sums = {0};
    for (uint32_t i = 0; i < steps; i++) {
        double sum = 0;
        for (uint32_t k = 0; k < pieces; k++) {
            const double low = piece * (i * pieces + k);
            sum += filter_weight(filter, axis, low) + 4 * filter_weight(filter, axis, low + piece / 2) + filter_weight(filter, axis, low + piece);
        }
        sums.push_back(sums.back() + sum);
    }
    std::vector<float> shares;
    for (const double sum : sums) shares.push_back(static_cast<float>(sum / sums.back()));
    return shares;
}

Status check_filter(const PixelFilter& filter) {
    using Kind = PixelFilter::Kind;
    if (filter.kind > Kind::sinc) return Status::failed("the pixel filter is of an unknown kind");
    for (const float radius : {filter.radius_x, filter.radius_y})
        if (!(radius > 0 && radius <= largest_filter_radius))
            return Status::failed("the radius of a pixel filter must be more than 0 and at most 64");
    if (!std::isfinite(filter.first) || !std::isfinite(filter.second)) return Status::failed("the pixel filter is not finite");
    // Narrower ones would be lost between the steps of a sum; pbrt's are 0.5 and 2.
    if (filter.kind == Kind::gaussian && !(filter.first > 0 && filter.first <= 1e6f))
        return Status::failed("a gaussian pixel filter must fall off, and not within a thousandth of a pixel");
    if (filter.kind == Kind::mitchell && !(mitchell(0, filter.first, filter.second) > 0))
        return Status::failed("the middle of a mitchell pixel filter must be positive");
    if (filter.kind == Kind::sinc && !(filter.first >= 1)) return Status::failed("the window of a sinc pixel filter must be 1 or more");
    for (const uint32_t axis : {0u, 1u})
        if (!(filter_weight(filter, axis, radius_along(filter, axis) / 4096) > 0)) return Status::failed("the pixel filter lets nothing through");
    return {};
}

}  // namespace raypager
