#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "import/loop_subdivision.hpp"
#include "import/pbrt_reader.hpp"
#include "import/ply_header.hpp"
#include "import/tessellate.hpp"
#include "import/text.hpp"
#include "raypager/materials.hpp"
#include "scene/vector.hpp"

namespace raypager {
namespace {

// Instances are placed as shapes of their own, so a small file can ask for any number of them; no more than there can be primitives.
constexpr size_t max_shapes = RP_NONE - 1;
// From here on, single precision is coarser than 8 mm if the unit is the metre.
constexpr double far_coordinate = 65536;
// Of subdivision surfaces: a few words in a file must not fill the memory.
constexpr uint32_t most_loop_levels = 6;
constexpr uint64_t most_loop_triangles = uint64_t{1} << 23;
constexpr double degrees = 3.14159265358979323846 / 180;

// Lengths and angles are the same in all directions: spheres stay spheres.
bool is_similarity(const Transform& t) {
    double gram[3][3], largest = 0;
    for (size_t i = 0; i < 3; ++i)
        for (size_t j = 0; j < 3; ++j) {
            gram[i][j] = t.m[0][i] * t.m[0][j] + t.m[1][i] * t.m[1][j] + t.m[2][i] * t.m[2][j];
            largest = std::max(largest, std::abs(gram[i][j]));
        }
    // Squares of lengths; what the file's six or seven digits leave of a rotation passes.
    const double tolerance = 1e-5 * largest;
    for (size_t i = 0; i < 3; ++i)
        for (size_t j = 0; j < 3; ++j)
            if (std::abs(gram[i][j] - (i == j ? gram[0][0] : 0.0)) > tolerance) return false;
    return true;
}

}  // namespace

Status PbrtReader::make_shape(const Directive& directive, const std::string& type, const PbrtParameters& parameters, Shape& shape) {
    shape.sphere.radius = 0;
    if (type == "trianglemesh") return triangle_mesh(directive, parameters, shape);
    if (type == "loopsubdiv") return loop_subdivision(directive, parameters, shape);
    if (type == "bilinearmesh") return bilinear_mesh(directive, parameters, shape);
    if (type == "plymesh") return ply_mesh(directive, parameters, shape);
    if (type == "sphere") return sphere(directive, parameters, shape);
    if (type == "points") return points(directive, parameters, shape);
    if (type == "disk") return disk(directive, parameters, shape);
    if (type == "cylinder") return cylinder(directive, parameters, shape);
    if (type == "cone") return cone(directive, parameters, shape);
    if (type == "paraboloid") return paraboloid(directive, parameters, shape);
    if (type == "hyperboloid") return hyperboloid(directive, parameters, shape);
    if (type == "curve") return curve(directive, parameters, shape);
    leave_out(directive, fmt::format("Shape \"{}\" is not supported; it is left out", clipped(type)));
    return {};
}

// Of a number or a texture that is the same everywhere; nothing if it varies or is not there. Beyond 0 and 1, alpha means what it means there.
std::optional<double> PbrtReader::constant_alpha(const PbrtParameter* alpha) const {
    if (!alpha) return std::nullopt;
    if (alpha->type == "float" && alpha->numbers.size() == 1) return std::clamp(alpha->numbers[0], 0.0, 1.0);
    if (alpha->type != "texture" || alpha->strings.size() != 1) return std::nullopt;
    const auto texture = textures_.floats.find(alpha->strings[0]);
    if (texture == textures_.floats.end() || !texture->second.approximated.empty()) return std::nullopt;
    return std::clamp(texture->second.value, 0.0, 1.0);
}

Status PbrtReader::shape(const Directive& directive) {
    std::string type;
    PbrtParameters parameters = no_parameters();
    RAYPAGER_TRY(take_type_and_parameters(type, parameters));
    if (!is_in_world(directive, type)) return {};
    const PbrtParameter* alpha = parameters.find("alpha");
    const std::optional<double> everywhere = constant_alpha(alpha);
    const bool unseen = everywhere == 0.0, opaque = everywhere == 1.0;
    if (unseen && !state_.area_light) return {};  // rays pass it: nothing to be seen
    if (!unseen && !opaque) warn_if_present(parameters, {"alpha"}, "the surface is opaque");
    Shape shape;
    shape.unseen = unseen;
    shape.name = directive.location.with_line();
    RAYPAGER_TRY(make_shape(directive, type, parameters, shape));
    RAYPAGER_TRY(parameters.status());
    if (!shape.mesh && !shape.points && !(shape.sphere.radius > 0)) return {};  // what was to be said was said
    warn_of_unused(directive, type, parameters,
                   {"uv", "st", "S", "faceIndices", "shadowalpha", "scheme", "edgelength", "discarddegenerateUVs", "splitdepth"});
    shape.to_world = state_.transform * shape.to_world;
    shape.reverse_orientation = state_.reverse_orientation;
    shape.area_light = state_.area_light;
    RAYPAGER_TRY(share_power(type, shape));
    if (unseen && shape.points) return {};
    if (shape.points && shape.area_light) {
        warn(directive.location, "points that shine are not supported; they reflect only");
        shape.area_light.reset();
    }
    shape.material = state_.material;
    if (state_.material == no_surface) {
        if (!state_.area_light) return {};  // nothing to be seen
        shape.material = static_cast<uint32_t>(scene_.materials.size());
        scene_.materials.push_back(clear_material());
    }
    if (!shape.to_world.inverse()) {
        leave_out(directive, "a transform that cannot be inverted flattens a shape; it is left out");
        return {};
    }
    if (!object_) return add_shape(directive, std::move(shape));
    object_->push_back(std::move(shape));
    return {};
}

Status PbrtReader::add_shape(const Directive& directive, Shape shape) {
    if (scene_.shapes.size() >= max_shapes)
        return error(directive, fmt::format("more than {} shapes; every instance counts as shapes of its own", max_shapes));
    scene_.shapes.push_back(std::move(shape));
    return {};
}

Status PbrtReader::mesh_in_memory(const Directive& directive, TriangleMesh mesh, Shape& shape) {
    shape.mesh = std::make_shared<MeshInMemory>(directive.location.with_line(), std::move(mesh));
    return {};
}

Status PbrtReader::triangle_mesh(const Directive& directive, const PbrtParameters& parameters, Shape& shape) {
    TriangleMesh mesh;
    mesh.positions = parameters.points("P");
    mesh.normals = parameters.points("N");
    std::vector<uint32_t> indices = parameters.indices("indices");
    RAYPAGER_TRY(parameters.status());
    if (indices.empty() && mesh.positions.size() == 3) indices = {0, 1, 2};
    if (mesh.positions.empty() || indices.size() < 3) {
        leave_out(directive, "a mesh without vertices or triangles is left out");
        return {};
    }
    if (indices.size() % 3 != 0) warn(directive.location, "the indices of a mesh do not come in threes; those behind the last triangle are ignored");
    if (!mesh.normals.empty() && mesh.normals.size() != mesh.positions.size()) {
        warn(directive.location, fmt::format("a mesh has {} normals for {} points; they are ignored", mesh.normals.size(), mesh.positions.size()));
        mesh.normals.clear();
    }
    mesh.triangles.reserve(indices.size() / 3);
    for (size_t i = 0; i + 2 < indices.size(); i += 3) mesh.triangles.push_back({indices[i], indices[i + 1], indices[i + 2]});
    return mesh_in_memory(directive, std::move(mesh), shape);
}

// A subdivision surface. Each level has four times the triangles of the one before.
Status PbrtReader::loop_subdivision(const Directive& directive, const PbrtParameters& parameters, Shape& shape) {
    const std::vector<Float3> positions = parameters.points("P");
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
    return mesh_in_memory(directive, subdivide_loop(positions, triangles, levels), shape);
}

// Patches of four points p00, p10, p01, p11.
Status PbrtReader::bilinear_mesh(const Directive& directive, const PbrtParameters& parameters, Shape& shape) {
    const std::vector<Float3> positions = parameters.points("P");
    std::vector<Float3> normals = parameters.points("N");
    std::vector<uint32_t> indices = parameters.indices("indices");
    RAYPAGER_TRY(parameters.status());
    if (indices.empty() && positions.size() == 4) indices = {0, 1, 2, 3};
    if (positions.empty() || indices.size() < 4) {
        leave_out(directive, "a bilinear mesh without vertices or patches is left out");
        return {};
    }
    if (indices.size() % 4 != 0)
        warn(directive.location, "the indices of a bilinear mesh do not come in fours; those behind the last patch are ignored");
    if (!normals.empty() && normals.size() != positions.size()) {
        warn(directive.location, fmt::format("a mesh has {} normals for {} points; they are ignored", normals.size(), positions.size()));
        normals.clear();
    }
    std::vector<Patch> patches;
    for (size_t i = 0; i + 3 < indices.size(); i += 4) patches.push_back({indices[i], indices[i + 1], indices[i + 2], indices[i + 3]});
    return mesh_in_memory(directive, tessellate_patches(positions, normals, patches), shape);
}

// The file of a mesh or cloud. One that is not there leaves its shape out, as pbrt does it.
Status PbrtReader::find_shape_file(const Directive& directive, const PbrtParameters& parameters, std::filesystem::path& path, bool& exists) {
    const std::string name = parameters.text("filename", "");
    RAYPAGER_TRY(parameters.status());
    if (const Status found = find_file(name, path, exists); !found.ok()) return error(directive, found.message());
    if (exists) return {};
    leave_out(directive, fmt::format("the file \"{}\" is not there; its shape is left out", name));
    return {};
}

namespace {

// A PLY file whose mesh has no vertices or faces: sound, but with nothing to be seen. Whatever else may be wrong is not found here, and one that
// knows no faces is a cloud.
bool is_empty_ply(const std::filesystem::path& path) {
    const auto file = InputFile::open(path);
    if (!file) return false;
    if (file->size() == 0) return true;
    const auto header = read_ply_header(*file);
    if (!header) return false;
    uint64_t vertices = 0, faces = 0;
    bool is_mesh = false;
    for (const PlyElement& element : header->elements) {
        if (element.name == "vertex") vertices += element.count;
        if (element.name != "face" && element.name != "tristrips") continue;
        faces += element.count;
        is_mesh = true;
    }
    return vertices == 0 || (is_mesh && faces == 0);
}

}  // namespace

// A file that several shapes name is the same source for all of them.
Status PbrtReader::ply_mesh(const Directive& directive, const PbrtParameters& parameters, Shape& shape) {
    std::filesystem::path path;
    bool exists = false;
    RAYPAGER_TRY(find_shape_file(directive, parameters, path, exists));
    if (!exists) return {};
    warn_if_present(parameters, {"displacement"}, "the mesh stays as it is");
    auto& source = mesh_files_[path.lexically_normal()];
    if (!source) {
        if (mesh_format(path) == MeshFormat::ply && is_empty_ply(path)) {
            leave_out(directive, fmt::format("the mesh \"{}\" has no vertices or no faces; it is left out", path.string()));
            return {};
        }
        const auto file = MeshFile::open(path);
        if (!file) return file.status().at(directive.location.with_line());
        source = *file;
    }
    shape.mesh = source;
    // Positions of surveyed meshes come relative to an origin, which is put back in double precision, as that of clouds.
    const auto& origin = source->origin();
    shape.to_world = Transform::translate(origin[0], origin[1], origin[2]);
    shape.vertex_colors = false;
    if (source->has_colors() && !std::exchange(has_noted_colors_, true))
        warn(directive.location, "the colours of PLY meshes are not used, as in pbrt: their material says how they look");
    return {};
}

// A point cloud; no shape of pbrt's, but raypager's own. Its origin is put back by the transform, which is carried out in double precision:
// with a Translate that brings surveyed coordinates near zero, none of their digits are lost.
Status PbrtReader::points(const Directive& directive, const PbrtParameters& parameters, Shape& shape) {
    const std::string names = parameters.text("columns", "");
    const double radius = parameters.number("radius", 0), scale = parameters.number("scale", 1);
    RAYPAGER_TRY(parameters.status());
    const auto columns = names.empty() ? Result<PointColumns>(columns_) : parse_point_columns(names);
    if (!columns) return error(directive, "columns: " + columns.status().message());
    if (!(radius >= 0) || !std::isfinite(static_cast<float>(radius))) return error(directive, "its radius must be 0 (from the spacing) or more");
    if (!(scale > 0) || !std::isfinite(static_cast<float>(scale))) return error(directive, "its scale must be more than 0");
    std::filesystem::path path;
    bool exists = false;
    RAYPAGER_TRY(find_shape_file(directive, parameters, path, exists));
    if (!exists) return {};
    auto& source = cloud_files_[{path.lexically_normal(), point_column_list(*columns)}];
    if (!source) {
        const auto file = CloudFile::open(path, *columns);
        if (!file) return file.status().at(directive.location.with_line());
        source = *file;
        for (const std::string& warning : source->warnings()) warn(directive.location, warning);
    }
    shape.points = source;
    shape.point_radius = static_cast<float>(radius);
    shape.radius_scale = static_cast<float>(scale);
    const auto& origin = source->origin();
    shape.to_world = Transform::translate(origin[0], origin[1], origin[2]);  // goes before the graphics state's
    const auto middle = (state_.transform * shape.to_world).point(0, 0, 0);
    if (std::max({std::abs(middle[0]), std::abs(middle[1]), std::abs(middle[2])}) > far_coordinate)
        warn(directive.location, fmt::format("points lie so far from the world's origin that their coordinates are rounded; bring them near it, with "
                                             "Translate {:.0f} {:.0f} {:.0f} before the shape",
                                             0 - origin[0], 0 - origin[1], 0 - origin[2]));
    return {};
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
    if (whole) return make_sphere(directive, radius, shape);
    if (z_min == z_max) return error(directive, "nothing is left of it between zmin and zmax");
    return mesh_in_memory(directive, tessellate_partial_sphere(radius, std::min(z_min, z_max), std::max(z_min, z_max), angle), shape);
}

// Sphere primitives face outwards.
Status PbrtReader::make_sphere(const Directive&, double radius, Shape& shape) {
    if (is_similarity(state_.transform) && !state_.reverse_orientation)
        shape.sphere.radius = static_cast<float>(radius);
    else
        make_ellipsoid(shape, radius);
    return {};
}

// All ellipsoids share one mesh: a few words in a file must not take megabytes each.
void PbrtReader::make_ellipsoid(Shape& shape, double radius) {
    if (!ball_) ball_ = std::make_shared<MeshInMemory>("an ellipsoid's mesh", tessellate_sphere(1));
    shape.mesh = ball_;
    shape.to_world = shape.to_world * Transform::scale(radius, radius, radius);
}

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
    return mesh_in_memory(directive, tessellate_disk(height, radius, inner, angle), shape);
}

Status PbrtReader::cylinder(const Directive& directive, const PbrtParameters& parameters, Shape& shape) {
    const double radius = parameters.number("radius", 1), z_min = parameters.number("zmin", -1), z_max = parameters.number("zmax", 1);
    double angle = 0;
    RAYPAGER_TRY(sweep(directive, parameters, angle));
    RAYPAGER_TRY(lengths(directive, {radius, std::abs(z_max - z_min)}));
    return mesh_in_memory(directive, tessellate_cylinder(radius, std::min(z_min, z_max), std::max(z_min, z_max), angle), shape);
}

Status PbrtReader::cone(const Directive& directive, const PbrtParameters& parameters, Shape& shape) {
    const double radius = parameters.number("radius", 1), height = parameters.number("height", 1);
    double angle = 0;
    RAYPAGER_TRY(sweep(directive, parameters, angle));
    RAYPAGER_TRY(lengths(directive, {radius, height}));
    return mesh_in_memory(directive, tessellate_cone(radius, height, angle), shape);
}

// radius: where z is the larger of the two heights.
Status PbrtReader::paraboloid(const Directive& directive, const PbrtParameters& parameters, Shape& shape) {
    const double radius = parameters.number("radius", 1), one = parameters.number("zmin", 0), other = parameters.number("zmax", 1);
    const double z_min = std::min(one, other), z_max = std::max(one, other);
    double angle = 0;
    RAYPAGER_TRY(sweep(directive, parameters, angle));
    RAYPAGER_TRY(lengths(directive, {radius, z_max - z_min}));
    if (!(z_min >= 0)) return error(directive, "its zmin must be 0 or more: there is no paraboloid below that");
    return mesh_in_memory(directive, tessellate_paraboloid(radius, z_min, z_max, angle), shape);
}

// Of version 3: what the line from p1 to p2 sweeps out.
Status PbrtReader::hyperboloid(const Directive& directive, const PbrtParameters& parameters, Shape& shape) {
    const auto from = parameters.point("p1", {0, 0, 0}), to = parameters.point("p2", {1, 1, 1});
    double angle = 0;
    RAYPAGER_TRY(sweep(directive, parameters, angle));
    RAYPAGER_TRY(lengths(directive, {length(to - from)}));
    if (std::hypot(from[0], from[1]) == 0 && std::hypot(to[0], to[1]) == 0) return error(directive, "its line lies on the axis");
    return mesh_in_memory(directive, tessellate_hyperboloid(from, to, angle), shape);
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
    TriangleMesh mesh = tessellate_curve(curve);
    if (mesh.triangles.empty()) {
        leave_out(directive, "a curve without length is left out");
        return {};
    }
    return mesh_in_memory(directive, std::move(mesh), shape);
}

// Instances are not shared: each places the object's shapes again.
Status PbrtReader::object_begin(const Directive& directive) {
    std::string name;
    RAYPAGER_TRY(take_string(name));
    if (object_) return error(directive, fmt::format("inside the object begun in {}", object_location_.with_line()));
    RAYPAGER_TRY(push(directive, Scope::object));
    object_ = &objects_[name];
    object_->clear();
    object_location_ = directive.location;
    return {};
}

Status PbrtReader::object_end(const Directive& directive) {
    if (!object_) return error(directive, "without ObjectBegin");
    pop(directive, Scope::object);
    object_ = nullptr;
    return {};
}

Status PbrtReader::object_instance(const Directive& directive) {
    std::string name;
    RAYPAGER_TRY(take_string(name));
    if (!is_in_world(directive, name)) return {};
    if (object_) {
        warn(directive.location, fmt::format("an object cannot contain instances; that of \"{}\" is left out", clipped(name)));
        return {};
    }
    const auto found = objects_.find(name);
    if (found == objects_.end()) {
        leave_out(directive, fmt::format("there is no object \"{}\"; the instance is left out", clipped(name)));
        return {};
    }
    if (!state_.transform.inverse()) {
        warn(directive.location, "a transform that cannot be inverted flattens an instance; it is left out");
        return {};
    }
    for (Shape shape : found->second) {
        // What is a sphere in the object is one in the world only if it is not stretched on the way.
        if (!shape.mesh && !shape.points && !is_similarity(state_.transform * shape.to_world)) {
            make_ellipsoid(shape, shape.sphere.radius);
        }
        shape.to_world = state_.transform * shape.to_world;
        RAYPAGER_TRY(add_shape(directive, std::move(shape)));
    }
    return {};
}

}  // namespace raypager
