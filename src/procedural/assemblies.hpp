// Groups of parts that belong together, as on a workshop floor. Each part comes with what it is made of.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "procedural/parts.hpp"

namespace raypager {

enum class Stuff : uint8_t { steel, iron, brass, copper, chrome, glass, red, blue, yellow, white, rubber };
constexpr size_t stuff_count = 11;
constexpr std::array<std::string_view, stuff_count> stuff_names = {"steel", "iron", "brass",  "copper", "chrome", "glass",
                                                                   "red",   "blue", "yellow", "white",  "rubber"};

// One mesh for each kind of stuff.
struct Assembly {
    std::array<TriangleMesh, stuff_count> meshes;
    TriangleMesh& of(Stuff stuff) { return meshes[static_cast<size_t>(stuff)]; }
    uint64_t triangles() const;
    void clear();
};

// Adds a random assembly of about the given size (metres) at place. detail scales how finely round things are divided: 1 is good to look
// at from near by.
void add_random_assembly(Assembly& assembly, const Pose& place, double size, double detail, Random& random);

// Segments for something round: more the larger it is.
uint32_t segments_for(double radius, double detail);

}  // namespace raypager
