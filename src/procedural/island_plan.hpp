// How an island's triangles and instances are spent, and where the copies of it lie.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

#include "procedural/make_scene.hpp"
#include "procedural/numeric.hpp"

namespace raypager {

// What is placed, in the order in which it is written. Trees come last: they take the triangles that all else leaves.
enum class IslandThing : uint8_t { pebble, boulder, shell, coral, driftwood, litter, tuft, rosette, fern, hedge, palm, tree };
constexpr size_t island_things = 12;

struct IslandKind {
    std::string_view name;   // of the objects: palm-00, palm-01, ...
    uint64_t kinds = 1;      // different ones
    uint64_t triangles = 0;  // of each of them, about; 0: what is left
    uint64_t instances = 0;  // of all of them
};

struct IslandPlan {
    explicit IslandPlan(const MakeSceneOptions& options);  // of which the numbers are not 0
    const IslandKind& operator[](IslandThing thing) const { return things[static_cast<size_t>(thing)]; }

    std::array<IslandKind, island_things> things;
    double radius;          // of the island
    uint64_t ground_quads;  // along a side
    uint64_t sea_quads;     // of the open sea, likewise
    uint64_t water_quads;   // likewise
    uint32_t image_size;    // of the painted ground and water
};

// Where a copy of the island lies, turned about the middle of the island.
struct IslandPlace {
    double x, z;  // from the middle of the first
    SinCos turn;
};

// The first is the island itself, at the origin and not turned; the others lie beside and behind it (to the north), at least so far from each
// other. An arrangement of hexagons, a little disturbed.
std::vector<IslandPlace> archipelago(uint64_t copies, double least_distance, uint64_t seed);

}  // namespace raypager
