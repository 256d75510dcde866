#include "import/framing.hpp"

#include <numbers>

namespace raypager {
namespace {

using std::numbers::pi;

constexpr double azimuth = 30 * pi / 180;
constexpr double filled = 0.88;  // of the frame, in the direction in which the object is larger

}  // namespace

Framing::Framing(const Axes& axes, double elevation, uint32_t width, uint32_t height) {
    const double angle = elevation * pi / 180;
    to_camera = unit(std::cos(angle) * (std::cos(azimuth) * axes.front + std::sin(azimuth) * axes.side) + std::sin(angle) * axes.up);
    right = unit(cross(axes.up, to_camera));
    up = cross(to_camera, right);
    const double t = filled * std::tan(field_of_view * pi / 360) / std::min(width, height);
    tan_x = t * width;
    tan_y = t * height;
}

Vector Framing::eye(double radius) const {
    const double across = (largest[0] + largest[1]) / 2, upright = (largest[2] + largest[3]) / 2;
    const double distance = std::max({across, upright, nearest + 0.1 * radius});
    return tan_x * (largest[0] - largest[1]) / 2 * right + tan_y * (largest[2] - largest[3]) / 2 * up + distance * to_camera;
}

}  // namespace raypager
