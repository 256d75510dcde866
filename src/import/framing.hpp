// Where to stand so that something fills the picture.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "raypager/scene.hpp"
#include "scene/vector.hpp"

namespace raypager {

// The world as the viewer's: up, towards the viewer's side of the object, and to the viewer's right.
struct Axes {
    Vector up = {}, front = {}, side = {};
};
constexpr Axes y_up = {{0, 1, 0}, {0, 0, 1}, {1, 0, 0}};
constexpr Axes z_up = {{0, 0, 1}, {0, -1, 0}, {1, 0, 0}};

constexpr double field_of_view = 35;  // degrees: a normal to slightly long lens

// Finds the camera position from which a set of points fills the frame, given the direction to it: 30 degrees to the right of the front and
// `elevation` degrees above. A point is inside the frame's left and right planes if |x - camera x| <= t (distance - z), so the two largest
// values of +-x / t + z decide; the same for y.
class Framing {
public:
    Framing(const Axes& axes, double elevation, uint32_t width, uint32_t height);
    // radius: of a ball around p.
    void add(const Vector& p, double radius = 0) {
        const double x = dot(p, right) / tan_x, y = dot(p, up) / tan_y, z = dot(p, to_camera);
        // So far must the planes of the frame's sides be moved along the view for a ball to be inside.
        const double across = radius * std::sqrt(1 + 1 / (tan_x * tan_x)), upright = radius * std::sqrt(1 + 1 / (tan_y * tan_y));
        largest = {std::max(largest[0], x + z + across), std::max(largest[1], z - x + across), std::max(largest[2], y + z + upright),
                   std::max(largest[3], z - y + upright)};
        nearest = std::max(nearest, z + radius);
    }
    // radius: of what is framed.
    Vector eye(double radius) const;

    Vector to_camera = {}, right = {}, up = {};

private:
    double tan_x, tan_y;
    std::array<double, 4> largest = {-INFINITY, -INFINITY, -INFINITY, -INFINITY};
    double nearest = -INFINITY;
};

}  // namespace raypager
