// Shapes -> the world.
#pragma once

#include <cmath>
#include <cstdint>
#include <optional>

#include "raypager/scene.hpp"
#include "raypager/status.hpp"
#include "world/world.hpp"

namespace raypager {

// The triangle test multiplies three distances in single precision, and that must stay finite.
inline constexpr double largest_coordinate = 1e12;

inline bool in_range(const Float3& p) {
    constexpr auto largest = static_cast<float>(largest_coordinate);
    return std::abs(p.x) <= largest && std::abs(p.y) <= largest && std::abs(p.z) <= largest;
}
Status out_of_range(const Shape& shape, uint64_t vertex, const Float3& position);
// Whether the triangle has no area, so that no ray can hit it.
bool has_no_area(const Float3& a, const Float3& b, const Float3& c);

// How the vertices of a mesh are placed: transformed in double precision and rounded once.
class PlacedShape {
public:
    // position_cell: vertices move to its nearest multiples along each axis; 0: they stay where they are.
    explicit PlacedShape(const Shape& shape, float position_cell);
    Float3 point(const Float3& p) const;
    // Octahedral. Normals go with the inverse transpose. Which side a shading normal points to is looked at only where it is used.
    uint32_t normal(const Float3& n) const;
    // Whether positions stay as they are.
    bool keeps_positions() const { return identity_ && cell_ == 0; }
    // Whether the order of a triangle's vertices is reversed.
    bool flips() const { return flips_; }

private:
    const Transform& to_world_;
    const double cell_;
    const bool identity_, flips_;
    std::optional<Transform> normals_;
};

// Nothing if no ray can hit it.
Result<std::optional<WorldSphere>> place_sphere(const Shape& shape);

}  // namespace raypager
