#include "world/instance_record.hpp"

#include <algorithm>
#include <cmath>
#include <span>

namespace raypager {
namespace {

// Of the compiler: both lanes at once, each with the same bits as a double alone.
using Double2 = double __attribute__((vector_size(16)));

template <class Take>
void for_each_corner(const Box& box, const Take& take) {
    for (unsigned corner = 0; corner < 8; corner++)
        take(corner & 1 ? box.upper[0] : box.lower[0], corner & 2 ? box.upper[1] : box.lower[1], corner & 4 ? box.upper[2] : box.lower[2]);
}

// From the center.
double farthest_corner(const Transform& placement, const Box& box, const float (&center)[3]) {
    double reach = 0;
    for_each_corner(box, [&](double x, double y, double z) {
        const auto p = placement.point(x, y, z);
        reach = std::max(reach, std::hypot(p[0] - center[0], p[1] - center[1], p[2] - center[2]));
    });
    return reach;
}

std::optional<Transform> placed_by(const rp_instance& instance, const Box& object_box) {
    Transform to_object;
    const auto base = middle_of(object_box);
    for (size_t i = 0; i < 3; i++) {
        to_object.m[i][3] = base[i];
        for (size_t j = 0; j < 3; j++) {
            to_object.m[i][j] = instance.to_object[3 * i + j];
            to_object.m[i][3] -= to_object.m[i][j] * instance.center[j];
        }
    }
    return to_object.inverse();
}

}  // namespace

std::array<double, 3> middle_of(const Box& object_box) {
    std::array<double, 3> middle = {};
    for (size_t a = 0; a < 3; a++) middle[a] = static_cast<float>((double{object_box.lower[a]} + object_box.upper[a]) / 2);
    return middle;
}

Transform placement_of(const rp_instance& instance, const Box& object_box) { return placed_by(instance, object_box).value_or(Transform()); }

std::optional<PlacedInstance> place_instance(const Transform& to_world, const Box& object_box) {
    const auto to_object = to_world.inverse();
    const auto& last = to_world.m[3];
    if (!to_object || object_box.empty() || last[0] != 0 || last[1] != 0 || last[2] != 0 || last[3] != 1) return std::nullopt;
    rp_instance instance = {};
    const auto base = middle_of(object_box), center = to_world.point(base[0], base[1], base[2]);
    bool sound = true;
    for (size_t i = 0; i < 3; i++) {
        instance.center[i] = static_cast<float>(center[i]);
        sound = sound && std::isfinite(instance.center[i]);
        for (size_t j = 0; j < 3; j++) {
            instance.to_object[3 * i + j] = static_cast<float>(to_object->m[i][j]);
            sound = sound && std::isfinite(instance.to_object[3 * i + j]);
        }
    }
    if (!sound) return std::nullopt;
    const auto placement = placed_by(instance, object_box);
    if (!placement) return std::nullopt;
    const double reach = farthest_corner(*placement, object_box, instance.center);
    instance.reach = static_cast<float>(reach * (1 + 1e-5));
    if (!std::isfinite(instance.reach)) return std::nullopt;
    return PlacedInstance{instance, *placement};
}

std::optional<rp_instance> make_instance(const Transform& to_world, const Box& object_box) {
    const auto placed = place_instance(to_world, object_box);
    return placed ? std::optional(placed->record) : std::nullopt;
}

Box bounds_of(const rp_instance& instance, const ObjectBounds& object) {
    return bounds_of(PlacedInstance{instance, placement_of(instance, object.box)}, object);
}

Box bounds_of(const PlacedInstance& placed, const ObjectBounds& object) {
    const auto& m = placed.placement.m;
    // Lanes are the axes of the world, two and one.
    std::array<Double2, 3> columns, sizes;
    for (size_t b = 0; b < 3; b++) {
        columns[b] = Double2{m[0][b], m[1][b]};
        sizes[b] = Double2{std::abs(m[0][b]), std::abs(m[1][b])};
    }
    Double2 lower_xy = {INFINITY, INFINITY}, upper_xy = -lower_xy;
    double lower_z = INFINITY, upper_z = -INFINITY;
    for (const Box& part : object.parts.empty() ? std::span(&object.box, 1) : std::span(object.parts)) {
        // An axis of the world sees of a box a middle and an extent.
        Double2 middle_xy = {m[0][3], m[1][3]}, extent_xy = {};
        double middle_z = m[2][3], extent_z = 0;
        for (size_t b = 0; b < 3; b++) {
            const double middle = (double{part.lower[b]} + part.upper[b]) / 2, extent = (double{part.upper[b]} - part.lower[b]) / 2;
            middle_xy += columns[b] * middle;
            extent_xy += sizes[b] * extent;
            middle_z += m[2][b] * middle;
            extent_z += std::abs(m[2][b]) * extent;
        }
        const Double2 from = middle_xy - extent_xy, to = middle_xy + extent_xy;
        lower_xy = from < lower_xy ? from : lower_xy;
        upper_xy = upper_xy < to ? to : upper_xy;
        lower_z = std::min(lower_z, middle_z - extent_z);
        upper_z = std::max(upper_z, middle_z + extent_z);
    }
    const double lower[3] = {lower_xy[0], lower_xy[1], lower_z}, upper[3] = {upper_xy[0], upper_xy[1], upper_z};
    double extent = 0, coordinate = 0;
    for (int a = 0; a < 3; a++) {
        extent = std::max(extent, upper[a] - lower[a]);
        coordinate = std::max({coordinate, std::abs(lower[a]), std::abs(upper[a])});
    }
    const double slack = static_cast<double>(RP_INSTANCE_SLACK) * (extent + coordinate);
    Box box;
    for (int a = 0; a < 3; a++) {
        box.lower[a] = std::nextafter(static_cast<float>(lower[a] - slack), -INFINITY);
        box.upper[a] = std::nextafter(static_cast<float>(upper[a] + slack), INFINITY);
    }
    return box;
}

}  // namespace raypager
