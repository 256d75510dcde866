// The land of a tropical island: two worn volcanoes, a coast with a bay to the south, beaches, and the floor of a lagoon. Metres; the island's
// middle is the origin, x is east, y up from the sea's level, z south.
#pragma once

#include <cstdint>
#include <vector>

#include "procedural/warped_grid.hpp"

namespace raypager {

class IslandLand {
public:
    // radius: of the island, about; quads: of the ground, along a side.
    IslandLand(double radius, uint64_t quads, uint64_t seed);

    double radius() const { return radius_; }
    double half() const { return 1.25 * radius_; }  // the ground is a square that reaches so far from the middle
    double beach() const { return beach_; }         // how wide it is
    // How far behind the shore that is; less than 0 in the water. Counted along the line to the island's middle.
    double inland(double x, double z) const;
    // Where one looks from, in the bay, a little above the water, and where its shore is.
    Vector eye() const { return eye_; }
    Vector bay() const { return bay_; }

    // The ground's lines lie closest where one looks from; images of it are painted along the same axes.
    const WarpedAxis& axis_x() const { return axis_x_; }
    const WarpedAxis& axis_z() const { return axis_z_; }
    GridMesh mesh() const;

    // On the triangles of the mesh, so that nothing hangs in the air however coarse they are.
    struct Footing {
        double height;
        Vector normal;
    };
    Footing footing(double x, double z) const;

private:
    double coast(double x, double z) const;  // its distance from the middle, in the direction of that place
    double height(double x, double z) const;
    double volcano(double x, double z, const Vector& middle, double reach, uint64_t seed) const;
    size_t index(size_t column, size_t row) const { return row * x_.size() + column; }

    double radius_, beach_;
    uint64_t seed_;
    Vector eye_{}, bay_{};
    WarpedAxis axis_x_, axis_z_;
    std::vector<double> x_, z_;   // of the ground's lines
    std::vector<float> heights_;  // where these cross
};

}  // namespace raypager
