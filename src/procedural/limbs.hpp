// Trunks, branches and whatever else is a tapered tube.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "procedural/numeric.hpp"

namespace raypager {

constexpr Vector upwards = {0, 1, 0};

uint32_t put_vertex(TriangleMesh& mesh, const Vector& p);  // returns its number
Vector heading(double turns);                              // horizontal, of length 1

struct Limb {
    std::vector<Vector> path;
    double radius = 0;  // at its root
    double length = 0;

    // Both at a share of its length, 0 to 1. REQUIRES: a path of two points or more.
    Vector at(double share) const;
    Vector direction(double share) const;
};

// Grows from a place into a direction, upwards by and by (or downwards, if rise is negative), and not quite straight.
Limb grow_limb(const Vector& from, Vector direction, double length, double radius, double rise, size_t steps, Random& random);

// A tube that ends in a point, open at its root. Its radius there is the limb's times 1 - taper.
void add_limb(TriangleMesh& mesh, const Limb& limb, uint32_t sides, double taper = 0.85);

}  // namespace raypager
