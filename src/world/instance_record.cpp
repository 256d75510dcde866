#include "world/instance_record.hpp"

#include <algorithm>
#include <cmath>
#include <span>

namespace raypager {
namespace {

template <class Take>
void for_each_corner(const Box& box, const Take& take) {
    for (unsigned corner = 0; corner < 8; corner++)
        take(corner & 1 ? box.upper[0] : box.lower[0], corner & 2 ? box.upper[1] : box.lower[1], corner & 4 ? box.upper[2] : box.lower[2]);
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
    double reach = 0;
    for_each_corner(object_box, [&](double x, double y, double z) {
        const auto p = placement->point(x, y, z);
        reach = std::max(reach, std::hypot(p[0] - instance.center[0], p[1] - instance.center[1], p[2] - instance.center[2]));
    });
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
    const Transform& placement = placed.placement;
    std::array<double, 3> lower, upper;
    lower.fill(INFINITY);
    upper.fill(-INFINITY);
    for (const Box& part : object.parts.empty() ? std::span(&object.box, 1) : std::span(object.parts))
        for (size_t a = 0; a < 3; a++) {
            // An axis of the world sees of a box a middle and an extent.
            double middle = placement.m[a][3], extent = 0;
            for (size_t b = 0; b < 3; b++) {
                middle += placement.m[a][b] * (double{part.lower[b]} + part.upper[b]) / 2;
                extent += std::abs(placement.m[a][b]) * (double{part.upper[b]} - part.lower[b]) / 2;
            }
            lower[a] = std::min(lower[a], middle - extent);
            upper[a] = std::max(upper[a], middle + extent);
        }
    double extent = 0, coordinate = 0;
    for (size_t a = 0; a < 3; a++) {
        extent = std::max(extent, upper[a] - lower[a]);
        coordinate = std::max({coordinate, std::abs(lower[a]), std::abs(upper[a])});
    }
    const double slack = static_cast<double>(RP_INSTANCE_SLACK) * (extent + coordinate);
    Box box;
    for (size_t a = 0; a < 3; a++) {
        box.lower[a] = std::nextafter(static_cast<float>(lower[a] - slack), -INFINITY);
        box.upper[a] = std::nextafter(static_cast<float>(upper[a] + slack), INFINITY);
    }
    return box;
}

}  // namespace raypager
