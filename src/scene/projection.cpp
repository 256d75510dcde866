#include "scene/projection.hpp"

#include <algorithm>
#include <numbers>

namespace raypager {
namespace {

// In (right, up, forward).
Vector equirectangular(double u, double v) {
    const double turn = 2 * std::numbers::pi * u, tilt = std::numbers::pi * v;
    return {std::sin(tilt) * std::cos(turn), std::cos(tilt), std::sin(tilt) * std::sin(turn)};
}

// kernels/common/camera.cl says whose map this is.
Vector equal_area(double u, double v) {
    const double x = 2 * u - 1, y = 2 * v - 1;
    const double inside = 1 - (std::abs(x) + std::abs(y)), r = 1 - std::abs(inside);
    const double turn = std::numbers::pi / 4 * (r == 0 ? 1 : (std::abs(y) - std::abs(x)) / r + 1), beside = r * std::sqrt(2 - r * r);
    return {std::copysign(std::cos(turn) * beside, x), std::copysign(1 - r * r, inside), std::copysign(std::sin(turn) * beside, y)};
}

}  // namespace

Status check_projection(const Camera& camera) {
    if (camera.projection > Projection::equal_area) return Status::failed("camera: of an unknown projection");
    const auto& w = camera.window;
    if (!std::all_of(w.begin(), w.end(), [](float x) { return std::isfinite(x); }) || !(w[2] > 0) || !(w[3] > 0))
        return Status::failed("camera: its window is empty");
    if (!(camera.lens_radius >= 0) || !std::isfinite(camera.lens_radius)) return Status::failed("camera: the radius of its lens must be 0 or more");
    if (camera.lens_radius > 0 && camera.sees_all_around()) return Status::failed("camera: one that sees all around has no lens");
    if (camera.lens_radius > 0 && (!(camera.focal_distance > 0) || !std::isfinite(camera.focal_distance)))
        return Status::failed("camera: the distance at which it is in focus must be more than 0");
    return {};
}

bool is_centered_perspective(const Camera& camera) {
    if (camera.projection != Projection::perspective) return false;
    const Vector forward = vector(camera.forward), right = vector(camera.right), up = vector(camera.up);
    const double f = length(forward), r = length(right), u = length(up);
    constexpr double tolerance = 1e-4;
    return f > 0 && r > 0 && u > 0 && std::abs(dot(forward, right)) <= tolerance * f * r && std::abs(dot(forward, up)) <= tolerance * f * u &&
           std::abs(dot(right, up)) <= tolerance * r * u;
}

ViewRay view_ray(const Camera& camera, double u, double v) {
    const Vector eye = vector(camera.eye), right = vector(camera.right), up = vector(camera.up), forward = vector(camera.forward);
    const double x = 2 * u - 1, y = 1 - 2 * v;
    if (camera.projection == Projection::perspective) return {eye, unit(forward + x * right + y * up)};
    if (camera.projection == Projection::orthographic) return {eye + x * right + y * up, unit(forward)};
    const double around = camera.window[0] + u * camera.window[2], down = camera.window[1] + v * camera.window[3];
    const Vector d = camera.projection == Projection::equirectangular ? equirectangular(around, down) : equal_area(around, down);
    return {eye, unit(d[0] * right + d[1] * up + d[2] * forward)};
}

}  // namespace raypager
