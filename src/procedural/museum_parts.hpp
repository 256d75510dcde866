// What stands and hangs in a museum, as meshes with coordinates of textures. Metres.
#pragma once

#include <cstdint>
#include <functional>
#include <string_view>

#include "procedural/parts.hpp"
#include "procedural/scene_writer.hpp"

namespace raypager {

void append_mesh(TriangleMesh& mesh, const TriangleMesh& part);

// u along right, v along up, as often as repeats say; seen from the side of cross(right, up).
void add_panel(TriangleMesh& mesh, const Vector& corner, const Vector& right, const Vector& up, double u_repeats = 1, double v_repeats = 1);
constexpr uint64_t panel_triangles = 2;

// On the ground at place, without a lower side; each side has the image once a metre.
void add_block(TriangleMesh& mesh, const Pose& place, double width, double height, double depth);
constexpr uint64_t block_triangles = 10;

// About a picture whose lower left corner is at place: mitred, with the metal's coordinates running along it. A fine one has a moulding.
void add_frame(TriangleMesh& mesh, const Pose& place, double width, double height, bool fine);
constexpr uint64_t frame_triangles(bool fine) { return fine ? 32 : 8; }

// A surface over rows x columns quads; where a whole row of vertices is one point, the triangles without area are left out.
struct UvGrid {
    uint64_t rows = 1, columns = 3;
    bool pole_below = false, pole_above = false;
    // v from 0 to 1 upwards, u from 0 to 1 around. Called from several threads.
    std::function<Vector(double u, double v)> position;
    double u_repeats = 1, v_repeats = 1;
    uint64_t triangles() const { return columns * (2 * rows - (pole_below ? 1 : 0) - (pole_above ? 1 : 0)); }
};
void add_grid(TriangleMesh& mesh, const UvGrid& grid);
// Files NAME-0, NAME-1, ..., of some hundred thousand triangles each.
Status write_grid(SceneWriter& scene, std::string_view name, std::string_view material, const UvGrid& grid);

// Of about so many triangles.
UvGrid statue_grid(const Vector& base, double height, uint64_t triangles, uint64_t seed);
UvGrid column_grid(const Vector& base, double radius, double height, uint64_t triangles);
UvGrid pot_grid(const Vector& base, double radius, double height, uint64_t triangles);

// Leaves that arch out of a pot, each a strip of quads with the image's bottom at the stem.
void add_leaves(TriangleMesh& mesh, const Vector& base, double size, uint32_t leaves, uint32_t segments, Random& random);

}  // namespace raypager
