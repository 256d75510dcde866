// Shapes of pbrt that become spheres, or triangles as near to them as import/README.md says.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "import/loop_subdivision.hpp"
#include "import/pbrt_reader.hpp"
#include "import/tessellate.hpp"
#include "import/text.hpp"
#include "scene/texture_use.hpp"
#include "scene/vector.hpp"

namespace raypager {
namespace {

// Of subdivision surfaces: a few words in a file must not fill the memory.
constexpr uint32_t most_loop_levels = 6;
constexpr uint64_t most_loop_triangles = uint64_t{1} << 23;
constexpr double degrees = 3.14159265358979323846 / 180;

}  // namespace

// A subdivision surface. Each level has four times the triangles of the one before.
Status PbrtReader::loop_subdivision(const Directive& directive, const PbrtParameters& parameters, Shape& shape) {
    const std::vector<Float3> positions = parameters.points("P");
    std::vector<Float2> uvs = parameters.uvs();
    const std::vector<uint32_t> indices = parameters.indices("indices");
    constexpr uint32_t any_number = 1u << 20;
    uint32_t levels = parameters.count(parameters.find("levels") ? "levels" : "nlevels", 3, any_number);
    RAYPAGER_TRY(parameters.status());
    if (positions.empty() || indices.size() < 3) {
        leave_out(directive, "a subdivision surface without vertices or triangles is left out");
        return {};
    }
    if (indices.size() % 3 != 0) warn(directive.location, "the indices of a mesh do not come in threes; those behind the last triangle are ignored");
    std::vector<Triangle> triangles;
    for (size_t i = 0; i + 2 < indices.size(); i += 3) triangles.push_back({indices[i], indices[i + 1], indices[i + 2]});
    const uint32_t wanted = levels;
    levels = std::min(levels, most_loop_levels);
    while (levels > 0 && triangles.size() > most_loop_triangles >> 2 * levels) levels--;
    if (levels < wanted) warn(directive.location, fmt::format("Shape \"loopsubdiv\" is subdivided {} times instead of {}", levels, wanted));
    check_uvs(directive, positions.size(), uvs);
    return mesh_in_memory(directive, subdivide_loop(positions, uvs, triangles, levels), shape);
}

// Patches of four points p00, p10, p01, p11.
Status PbrtReader::bilinear_mesh(const Directive& directive, const PbrtParameters& parameters, Shape& shape) {
    PatchMesh mesh;
    mesh.positions = parameters.points("P");
    mesh.normals = parameters.points("N");
    mesh.uvs = parameters.uvs();
    mesh.own_uvs = wants_uvs();
    std::vector<uint32_t> indices = parameters.indices("indices");
    RAYPAGER_TRY(parameters.status());
    if (indices.empty() && mesh.positions.size() == 4) indices = {0, 1, 2, 3};
    if (mesh.positions.empty() || indices.size() < 4) {
        leave_out(directive, "a bilinear mesh without vertices or patches is left out");
        return {};
    }
    if (indices.size() % 4 != 0)
        warn(directive.location, "the indices of a bilinear mesh do not come in fours; those behind the last patch are ignored");
    if (!mesh.normals.empty() && mesh.normals.size() != mesh.positions.size()) {
        warn(directive.location, fmt::format("a mesh has {} normals for {} points; they are ignored", mesh.normals.size(), mesh.positions.size()));
        mesh.normals.clear();
    }
    check_uvs(directive, mesh.positions.size(), mesh.uvs);
    for (size_t i = 0; i + 3 < indices.size(); i += 4) mesh.patches.push_back({indices[i], indices[i + 1], indices[i + 2], indices[i + 3]});
    return mesh_in_memory(directive, tessellate_patches(mesh), shape);
}

Status PbrtReader::sphere(const Directive& directive, const PbrtParameters& parameters, Shape& shape) {
    const double radius = parameters.number("radius", 1);
    RAYPAGER_TRY(parameters.status());
    if (radius == 0) {
        leave_out(directive, "a sphere of radius 0 is left out");
        return {};
    }
    if (!(static_cast<float>(radius) > 0) || !std::isfinite(static_cast<float>(radius))) return error(directive, "its radius must be more than 0");
    const double z_min = std::clamp(parameters.number("zmin", -radius), -radius, radius);
    const double z_max = std::clamp(parameters.number("zmax", radius), -radius, radius);
    double angle = 0;
    RAYPAGER_TRY(sweep(directive, parameters, angle));
    const bool whole = std::min(z_min, z_max) == -radius && std::max(z_min, z_max) == radius && angle == 360 * degrees;
    if (whole) {
        make_sphere(radius, shape);
        return {};
    }
    if (z_min == z_max) return error(directive, "nothing is left of it between zmin and zmax");
    return mesh_in_memory(directive, tessellate_partial_sphere(radius, std::min(z_min, z_max), std::max(z_min, z_max), angle, wants_uvs()), shape);
}

// Sphere primitives face outwards.
void PbrtReader::make_sphere(double radius, Shape& shape) {
    if (state_.transform.is_similarity() && !state_.reverse_orientation)
        shape.sphere.radius = static_cast<float>(radius);
    else
        make_ellipsoid(shape, radius, wants_uvs());
}

// All ellipsoids share one mesh, or two: a few words in a file must not take megabytes each.
void PbrtReader::make_ellipsoid(Shape& shape, double radius, bool uvs) {
    auto& ball = uvs ? ball_with_uvs_ : ball_;
    if (!ball) ball = std::make_shared<MeshInMemory>("an ellipsoid's mesh", tessellate_sphere(1, uvs));
    shape.mesh = ball;
    shape.to_world = shape.to_world * Transform::scale(radius, radius, radius);
}

// Whether what the shape at hand is made of reads textures.
bool PbrtReader::wants_uvs() const { return textured_alpha_ || uses_uvs(scene_, state_.material); }

// How far a shape goes around z.
Status PbrtReader::sweep(const Directive& directive, const PbrtParameters& parameters, double& radians) {
    radians = std::clamp(parameters.number("phimax", 360), 0.0, 360.0) * degrees;
    RAYPAGER_TRY(parameters.status());
    return radians > 0 ? Status() : error(directive, "its phimax must be more than 0");
}

// Which single precision must hold, too.
Status PbrtReader::lengths(const Directive& directive, std::initializer_list<double> values) {
    for (const double value : values)
        if (!(static_cast<float>(value) > 0) || !std::isfinite(static_cast<float>(value)))
            return error(directive, "its radius and height must be more than 0");
    return {};
}

Status PbrtReader::disk(const Directive& directive, const PbrtParameters& parameters, Shape& shape) {
    const double height = parameters.number("height", 0), radius = parameters.number("radius", 1), inner = parameters.number("innerradius", 0);
    double angle = 0;
    RAYPAGER_TRY(sweep(directive, parameters, angle));
    if (!(radius > 0) || !(inner >= 0 && inner < radius)) return error(directive, "its radii must be 0 <= innerradius < radius");
    return mesh_in_memory(directive, tessellate_disk(height, radius, inner, angle, wants_uvs()), shape);
}

Status PbrtReader::cylinder(const Directive& directive, const PbrtParameters& parameters, Shape& shape) {
    const double radius = parameters.number("radius", 1), z_min = parameters.number("zmin", -1), z_max = parameters.number("zmax", 1);
    double angle = 0;
    RAYPAGER_TRY(sweep(directive, parameters, angle));
    RAYPAGER_TRY(lengths(directive, {radius, std::abs(z_max - z_min)}));
    return mesh_in_memory(directive, tessellate_cylinder(radius, std::min(z_min, z_max), std::max(z_min, z_max), angle, wants_uvs()), shape);
}

Status PbrtReader::cone(const Directive& directive, const PbrtParameters& parameters, Shape& shape) {
    const double radius = parameters.number("radius", 1), height = parameters.number("height", 1);
    double angle = 0;
    RAYPAGER_TRY(sweep(directive, parameters, angle));
    RAYPAGER_TRY(lengths(directive, {radius, height}));
    return mesh_in_memory(directive, tessellate_cone(radius, height, angle, wants_uvs()), shape);
}

// radius: where z is the larger of the two heights.
Status PbrtReader::paraboloid(const Directive& directive, const PbrtParameters& parameters, Shape& shape) {
    const double radius = parameters.number("radius", 1), one = parameters.number("zmin", 0), other = parameters.number("zmax", 1);
    const double z_min = std::min(one, other), z_max = std::max(one, other);
    double angle = 0;
    RAYPAGER_TRY(sweep(directive, parameters, angle));
    RAYPAGER_TRY(lengths(directive, {radius, z_max - z_min}));
    if (!(z_min >= 0)) return error(directive, "its zmin must be 0 or more: there is no paraboloid below that");
    return mesh_in_memory(directive, tessellate_paraboloid(radius, z_min, z_max, angle, wants_uvs()), shape);
}

// Of version 3: what the line from p1 to p2 sweeps out.
Status PbrtReader::hyperboloid(const Directive& directive, const PbrtParameters& parameters, Shape& shape) {
    const auto from = parameters.point("p1", {0, 0, 0}), to = parameters.point("p2", {1, 1, 1});
    double angle = 0;
    RAYPAGER_TRY(sweep(directive, parameters, angle));
    RAYPAGER_TRY(lengths(directive, {length(to - from)}));
    if (std::hypot(from[0], from[1]) == 0 && std::hypot(to[0], to[1]) == 0) return error(directive, "its line lies on the axis");
    return mesh_in_memory(directive, tessellate_hyperboloid(from, to, angle, wants_uvs()), shape);
}

Status PbrtReader::curve_points(const Directive& directive, const PbrtParameters& parameters, CurveShape& curve) {
    const std::string basis = parameters.text("basis", "bezier");
    const uint32_t degree = parameters.count("degree", 3, 3);
    std::vector<Vector> points, normals;
    for (const Float3& p : parameters.points("P")) points.push_back(vector(p));
    for (const Float3& n : parameters.points("N")) normals.push_back(vector(n));
    RAYPAGER_TRY(parameters.status());
    if (basis != "bezier" && basis != "bspline")
        return error(directive, fmt::format("there is no basis \"{}\"; it is bezier or bspline", clipped(basis)));
    if (degree < 2) return error(directive, "its degree must be 2 or 3");
    const size_t segments = curve_segments(points.size(), degree, basis == "bspline");
    if (segments == 0) return error(directive, fmt::format("{} control points make no {} curve of degree {}", points.size(), basis, degree));
    curve.points = cubic_bezier_points(points, degree, basis == "bspline");
    if (curve.type != CurveShape::Type::ribbon) return {};
    if (normals.size() != segments + 1) return error(directive, fmt::format("a ribbon of {} segments needs {} normals", segments, segments + 1));
    for (const Vector& n : normals) {
        if (!(length(n) > 0)) return error(directive, "a normal of its ribbon has no length");
        curve.normals.push_back(unit(n));
    }
    return {};
}

Status PbrtReader::curve(const Directive& directive, const PbrtParameters& parameters, Shape& shape) {
    CurveShape curve;
    const std::string type = parameters.text("type", "flat");
    const double width = parameters.number("width", 1);
    curve.first_width = parameters.number("width0", width);
    curve.last_width = parameters.number("width1", width);
    RAYPAGER_TRY(parameters.status());
    if (type == "cylinder")
        curve.type = CurveShape::Type::cylinder;
    else if (type == "ribbon")
        curve.type = CurveShape::Type::ribbon;
    else if (type != "flat")
        return error(directive, fmt::format("there is no curve of type \"{}\"; it is flat, cylinder or ribbon", clipped(type)));
    if (!(curve.first_width >= 0) || !(curve.last_width >= 0) || !(std::max(curve.first_width, curve.last_width) > 0))
        return error(directive, "its widths must be 0 or more, and not both 0");
    RAYPAGER_TRY(curve_points(directive, parameters, curve));
    TriangleMesh mesh = tessellate_curve(curve, wants_uvs());
    if (mesh.triangles.empty()) {
        leave_out(directive, "a curve without length is left out");
        return {};
    }
    return mesh_in_memory(directive, std::move(mesh), shape);
}

}  // namespace raypager
