#include "import/bare_scene.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "import/bare_clouds.hpp"
#include "import/bare_look.hpp"
#include "import/bare_meshes.hpp"
#include "import/framing.hpp"
#include "import/point_readers.hpp"
#include "raypager/materials.hpp"

namespace raypager {
namespace {

// Degrees above the ground from which things are looked at.
constexpr double object_elevation = 22, landscape_elevation = 38;

// What one look at all triangles tells.
struct Survey {
    Vector lower = {INFINITY, INFINITY, INFINITY}, upper = {-INFINITY, -INFINITY, -INFINITY};
    Vector area = {0, 0, 0};  // sum of the triangles' area vectors
    Vector base = {0, 0, 0};  // area of the base by axis, as seen from below
    Vector center() const { return 0.5 * (lower + upper); }
    double radius() const { return 0.5 * length(upper - lower); }
    double footprint(size_t axis) const { return (upper[(axis + 1) % 3] - lower[(axis + 1) % 3]) * (upper[(axis + 2) % 3] - lower[(axis + 2) % 3]); }
};

void survey_bounds(const TriangleMesh& mesh, Survey& survey) {
    for (const Triangle& t : mesh.triangles)
        for (const uint32_t index : t) {
            const Vector p = vector(mesh.positions[index]);
            for (size_t a = 0; a < 3; ++a) {
                survey.lower[a] = std::min(survey.lower[a], p[a]);
                survey.upper[a] = std::max(survey.upper[a], p[a]);
            }
        }
}

// bounds: of this mesh alone; several meshes may stand side by side. count: triangles for which each of these stands.
void survey_areas(const TriangleMesh& mesh, const Survey& bounds, double count, Survey& survey) {
    for (const Triangle& t : mesh.triangles) {
        const Vector p[3] = {vector(mesh.positions[t[0]]), vector(mesh.positions[t[1]]), vector(mesh.positions[t[2]])};
        const Vector area = 0.5 * count * cross(p[1] - p[0], p[2] - p[0]);
        survey.area = survey.area + area;
        for (size_t a = 0; a < 3; ++a) {
            const double top = std::max({p[0][a], p[1][a], p[2][a]});
            if (area[a] < 0 && top - bounds.lower[a] <= 0.02 * (bounds.upper[a] - bounds.lower[a])) survey.base[a] -= area[a];
        }
    }
}

bool stands_on_z(const Survey& s) {
    const double foot_y = s.footprint(1), foot_z = s.footprint(2);
    const double sheet_y = foot_y > 0 ? std::abs(s.area[1]) / foot_y : 0, sheet_z = foot_z > 0 ? std::abs(s.area[2]) / foot_z : 0;
    if (std::max(sheet_y, sheet_z) > 0.5) return sheet_z > sheet_y;
    const double base_y = foot_y > 0 ? s.base[1] / foot_y : 0, base_z = foot_z > 0 ? s.base[2] / foot_z : 0;
    return base_z > 0.05 && base_z > 3 * base_y;
}

struct Inputs {
    BareMeshes meshes;
    Vector origin = {0, 0, 0};  // all inputs are shown relative to it
    std::vector<std::shared_ptr<const CloudFile>> clouds;
    CloudSurvey cloud;  // of all clouds
    Survey survey;      // of all meshes, with the clouds' bounds
    Framing from_y, from_z;
};

Status open_clouds(const std::vector<std::filesystem::path>& paths, const PointColumns& columns, Inputs& inputs) {
    for (const auto& path : paths) {
        if (!is_cloud_file(path)) continue;
        const auto cloud = CloudFile::open(path, columns);
        if (!cloud) return cloud.status();
        inputs.clouds.push_back(*cloud);
    }
    auto survey = survey_clouds(inputs.clouds);
    if (!survey) return survey.status();
    inputs.cloud = std::move(*survey);
    return {};
}

// Frames the clouds' points; bounds grow by them.
void frame_clouds(Inputs& inputs) {
    for (size_t a = 0; a < 3 && !inputs.clouds.empty(); ++a) {
        inputs.survey.lower[a] = std::min(inputs.survey.lower[a], inputs.cloud.lower[a]);
        inputs.survey.upper[a] = std::max(inputs.survey.upper[a], inputs.cloud.upper[a]);
    }
    for (const Vector& p : inputs.cloud.points) {
        inputs.from_y.add(p, inputs.cloud.ball);
        inputs.from_z.add(p, inputs.cloud.ball);
    }
}

Status check_bounds(const Survey& own, const std::string& name) {
    for (size_t a = 0; a < 3; ++a)
        if (std::max(-own.lower[a], own.upper[a]) > largest_file_coordinate)
            return Status::failed(fmt::format("{}: has coordinates beyond {:g}; scale it down", name, largest_file_coordinate));
    return {};
}

// Takes a look at a mesh: its bounds, areas and frame. origin: what is to be added to its positions. count: triangles for which each of these stands.
Status look_at(const TriangleMesh& mesh, const std::string& name, const Vector& origin, double count, Survey own, Inputs& inputs) {
    survey_bounds(mesh, own);
    RAYPAGER_TRY(check_bounds(own, name));
    const Vector shift = origin - inputs.origin;
    for (size_t a = 0; a < 3; ++a) {
        inputs.survey.lower[a] = std::min(inputs.survey.lower[a], own.lower[a] + shift[a]);
        inputs.survey.upper[a] = std::max(inputs.survey.upper[a], own.upper[a] + shift[a]);
    }
    survey_areas(mesh, own, count, inputs.survey);
    for (const Triangle& t : mesh.triangles)
        for (const uint32_t index : t) {
            const Vector p = vector(mesh.positions[index]) + shift;
            inputs.from_y.add(p);
            inputs.from_z.add(p);
        }
    return {};
}

// Looks at every mesh, and keeps what fits into keep_bytes of those that were read as a whole.
Status look_at_meshes(const std::vector<BareMeshFile>& files, uint64_t keep_bytes, Inputs& inputs) {
    for (const BareMeshFile& file : files) {
        const auto look = [&](const MeshSample& sample, bool whole, const MeshIssues& issues) -> Status {
            const std::string name = file.path.string();
            if (sample.mesh.triangles.empty())
                return Status::failed(fmt::format("{}: has no triangle that can be seen{}", name, issues.any() ? ": " + issues.describe() : ""));
            Survey own;
            if (!whole) {
                own.lower = vector(sample.lower);
                own.upper = vector(sample.upper);
            }
            return look_at(sample.mesh, name, file.origin(), sample.triangles, own, inputs);
        };
        RAYPAGER_TRY(add_bare_meshes(file, keep_bytes, look, inputs.meshes));
    }
    return {};
}

// Of the first input that is far from its own.
Vector common_origin(const Inputs& inputs, const std::vector<BareMeshFile>& files) {
    if (!inputs.clouds.empty()) return inputs.cloud.origin;
    for (const BareMeshFile& file : files)
        if (file.origin() != Vector{0, 0, 0}) return file.origin();
    return {0, 0, 0};
}

// Far from the sizes that single precision is good for, the world is scaled, by a power of two so that no coordinate is rounded.
double world_scale(double radius) { return radius >= 1e-3 && radius <= 1e6 ? 1.0 : std::exp2(-std::round(std::log2(radius))); }

// Parts of the shape are not there.
void cut_out(Scene& scene, const Texture& opacity, Shape& shape) {
    TexturedMaterial material{mix_material(RP_NONE, shape.material, opacity.mean_number()), {}};
    material.textures.push_back({RP_PARAMETER_AMOUNT, opacity});
    if (add_material(scene, material)) shape.material = static_cast<uint32_t>(scene.materials.size() - 1);
}

// What stands in the scene, without ground and light.
void add_objects(const Inputs& inputs, double scale, Scene& scene) {
    const Vector origin = inputs.origin;
    const auto add = [&](const std::string& name, const Vector& shift) -> Shape& {
        Shape shape;
        shape.name = name;
        shape.to_world = Transform::scale(scale, scale, scale) * Transform::translate(shift[0], shift[1], shift[2]);
        return scene.shapes.emplace_back(std::move(shape));
    };
    for (const BareMesh& mesh : inputs.meshes.meshes) {
        Shape& shape = add(mesh.source->name(), mesh.origin - origin);
        shape.mesh = mesh.source;
        if (mesh.material) {
            if (!add_material(scene, *mesh.material))
                scene.warnings.push_back(
                    fmt::format("{}: its textures are more than a path can keep; their mid values are used", mesh.source->name()));
            shape.material = static_cast<uint32_t>(scene.materials.size() - 1);
            // A light is sampled as a whole.
            if (mesh.opacity && !mesh.radiance) cut_out(scene, *mesh.opacity, shape);
        }
        if (mesh.radiance) shape.area_light = static_cast<uint32_t>(scene.area_lights.size());
        if (mesh.radiance) scene.area_lights.push_back({*mesh.radiance, true});
    }
    for (const auto& cloud : inputs.clouds) {
        add(cloud->name(), cloud->origin() - origin).points = cloud;
        scene.warnings.insert(scene.warnings.end(), cloud->warnings().begin(), cloud->warnings().end());
    }
    if (origin != Vector{0, 0, 0})
        scene.warnings.push_back(fmt::format("{}: is far from the origin; coordinates are shown relative to ({:.0f}, {:.0f}, {:.0f})",
                                             inputs.clouds.empty() ? scene.shapes.front().name : inputs.clouds.front()->name(), origin[0], origin[1],
                                             origin[2]));
}

}  // namespace

Result<Scene> import_bare(const std::vector<std::filesystem::path>& paths, const ImportOptions& options) {
    const BareLook& look = options.look;
    Scene scene;
    if (look.width > 0 && look.height > 0) {
        scene.width = look.width;
        scene.height = look.height;
    }
    Inputs inputs{
        {}, {}, {}, {}, {}, Framing(y_up, object_elevation, scene.width, scene.height), Framing(z_up, object_elevation, scene.width, scene.height)};
    RAYPAGER_TRY(open_clouds(paths, options.columns, inputs));
    const bool landscape = inputs.cloud.landscape;
    if (landscape) inputs.from_z = Framing(z_up, landscape_elevation, scene.width, scene.height);
    frame_clouds(inputs);
    const auto mesh_files = open_mesh_files(paths);
    if (!mesh_files) return mesh_files.status();
    inputs.origin = common_origin(inputs, *mesh_files);
    RAYPAGER_TRY(look_at_meshes(*mesh_files, options.keep_bytes, inputs));
    scene.files = inputs.meshes.files;
    scene.warnings = inputs.meshes.warnings;

    const Survey& survey = inputs.survey;
    const bool z_is_up = inputs.cloud.z_up || (!inputs.meshes.meshes.empty() && stands_on_z(survey));
    const Axes& axes = z_is_up ? z_up : y_up;
    const Framing& view = z_is_up ? inputs.from_z : inputs.from_y;
    const double scale = world_scale(survey.radius()), radius = scale * survey.radius();
    const Vector eye = scale * view.eye(survey.radius());
    const auto camera = make_camera(float3(eye), float3(eye - radius * view.to_camera), float3(axes.up), field_of_view, scene.width, scene.height);
    if (!camera) return Status::failed(paths.front().string() + ": cannot be framed; its extent is too small for its distance from the origin");
    scene.camera = *camera;

    // Light clay on a warm grey ground.
    constexpr uint32_t ground_material = 1;
    scene.materials = {clay_material(), bare_ground_material()};
    add_objects(inputs, scale, scene);
    if (look.material)
        for (const Shape& shape : scene.shapes) scene.materials[shape.material] = *look.material;
    const BareSubject subject = {scale * survey.center(), radius, scale * dot(survey.lower, axes.up), landscape, !inputs.clouds.empty()};
    light_bare_scene(look, subject, view, axes, ground_material, scene);
    RAYPAGER_TRY(validate(scene));
    return scene;
}

}  // namespace raypager
