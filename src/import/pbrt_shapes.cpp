#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "import/pbrt_reader.hpp"
#include "import/ply_header.hpp"
#include "import/text.hpp"
#include "import/triangles_apart.hpp"
#include "raypager/materials.hpp"
#include "scene/check_material.hpp"
#include "scene/texture_use.hpp"

namespace raypager {
namespace {

// Some instances are placed as shapes of their own, so a small file can ask for any number of them; no more than there can be primitives.
constexpr size_t max_shapes = RP_NONE - 1;

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
    if (texture == textures_.floats.end() || texture->second.approximated || !texture->second.value.is_constant()) return std::nullopt;
    return std::clamp(double{texture->second.value.mean().x}, 0.0, 1.0);
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
    textured_alpha_ = alpha && alpha->type == "texture";
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
    if (alpha && !unseen && !opaque) RAYPAGER_TRY(cut_out(directive, parameters, shape));
    give_faces(directive, type, parameters, shape);
    if (!shape.to_world.inverse()) {
        leave_out(directive, "a transform that cannot be inverted flattens a shape; it is left out");
        return {};
    }
    const Status added = add_shape(std::move(shape));
    return added.ok() ? added : error(directive, added.message());
}

// Gives a shape a material that is there as often as its alpha says. What shines stays whole, as a light is sampled.
Status PbrtReader::cut_out(const Directive& directive, const PbrtParameters& parameters, Shape& shape) {
    Texture alpha(1.0);
    RAYPAGER_TRY(number_texture(parameters, {"alpha"}, 1, alpha));
    if (alpha.is_constant() && alpha.mean().x >= 1) return {};
    const char* const left_out = shape.area_light                                              ? "of what shines"
                                 : shape.points                                                ? "of points"
                                 : mix_depth(scene_.materials, shape.material) >= RP_MAX_MIXES ? "of so many mixes within each other"
                                                                                               : nullptr;
    if (left_out) {
        warn(directive.location, fmt::format("parameter \"alpha\" {} is not supported; the surface is opaque", left_out));
        return {};
    }
    const auto key = std::make_tuple(shape.material, static_cast<const void*>(alpha.node()), alpha.mean().x);
    const auto known = cut_outs_.find(key);
    if (known != cut_outs_.end()) {
        shape.material = known->second;
        return {};
    }
    TexturedMaterial material{mix_material(RP_NONE, shape.material, alpha.mean().x), {}};
    if (!alpha.is_constant()) material.textures.push_back({RP_PARAMETER_AMOUNT, alpha});
    shape.material = keep_material(directive, material);
    cut_outs_[key] = shape.material;
    return {};
}

// To the object that is being defined, or to the scene.
Status PbrtReader::add_shape(Shape shape) {
    std::vector<Shape>& shapes = object_ ? object_->shapes : scene_.shapes;
    if (shapes.size() >= max_shapes)
        return Status::failed(fmt::format("more than {} shapes; instances that are written out count as shapes of their own", max_shapes));
    shapes.push_back(std::move(shape));
    return {};
}

Status PbrtReader::mesh_in_memory(const Directive& directive, TriangleMesh mesh, Shape& shape) {
    shape.mesh = std::make_shared<MeshInMemory>(directive.location.with_line(), std::move(mesh));
    return {};
}

void PbrtReader::check_uvs(const Directive& directive, size_t points, std::vector<Float2>& uvs) {
    if (uvs.empty() || uvs.size() == points) return;
    warn(directive.location, fmt::format("a mesh has {} pairs of uv for {} points; they are ignored", uvs.size(), points));
    uvs.clear();
}

Status PbrtReader::triangle_mesh(const Directive& directive, const PbrtParameters& parameters, Shape& shape) {
    TriangleMesh mesh;
    mesh.positions = parameters.points("P");
    mesh.normals = parameters.points("N");
    mesh.uvs = parameters.uvs();
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
    check_uvs(directive, mesh.positions.size(), mesh.uvs);
    mesh.triangles.reserve(indices.size() / 3);
    for (size_t i = 0; i + 2 < indices.size(); i += 3) mesh.triangles.push_back({indices[i], indices[i + 1], indices[i + 2]});
    if (mesh.uvs.empty() && wants_uvs()) mesh = triangles_apart(mesh, [](size_t, size_t k) { return uvs_of_bare_triangle[k]; });
    return mesh_in_memory(directive, std::move(mesh), shape);
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

}  // namespace raypager
