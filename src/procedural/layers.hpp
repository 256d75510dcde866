// Instances of some kinds of things, strewn over a square of land as densely as a function says, in files that the scene includes.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <utility>

#include "procedural/numeric.hpp"
#include "procedural/scene_writer.hpp"

namespace raypager {

// Where something stands, as a matrix of columns x, y, z and origin.
struct Stance {
    Vector x, y, z, origin;
};

// Turned about its y axis, which is up (a unit vector, not horizontal), by a random angle.
Stance turned_stance(const Vector& at, const Vector& up, Random& random);
Stance scaled(Stance stance, double across, double along);

// A line of a scene that places an object.
std::string instance_line(const Stance& stance, std::string_view object);

// Instances of some kinds, on the cells of a grid: as many in each as the density there says, up to rounding, which is carried on to the next.
// Kind 3 of the layer "rock" is an instance of the object "rock-03". Both functions are called from several threads.
struct Layer {
    std::string_view name;
    uint64_t kinds = 1, count = 0;
    std::function<double(double x, double z)> density;  // nowhere less than 0, somewhere more
    // Which kind stands there, and how.
    std::function<std::pair<uint64_t, Stance>(double x, double z, Random& random)> place;
};

// x and z of the land go from 0 to side. origin: in the coordinates of stances, becomes that of the scene.
struct LayerGround {
    double side;
    Vector origin;
};

// Files instances/NAME-0000.pbrt and so on, of some MiB each, in memory that does not depend on how many instances there are.
Status write_layer(SceneWriter& scene, const Layer& layer, const LayerGround& ground, uint64_t seed);

}  // namespace raypager
