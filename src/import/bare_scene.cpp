#include "import/bare_scene.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "import/bare_clouds.hpp"
#include "import/bare_meshes.hpp"
#include "import/framing.hpp"
#include "import/materials.hpp"
#include "import/point_readers.hpp"

namespace raypager {
namespace {

using std::numbers::pi;

// Degrees above the ground from which things are looked at.
constexpr double object_elevation = 22, landscape_elevation = 38;
constexpr double largest_ground = 40;  // in radii of the object

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

std::shared_ptr<const MeshSource> in_memory(const char* name, TriangleMesh mesh) { return std::make_shared<MeshInMemory>(name, std::move(mesh)); }

// A disc under the object that reaches as far as the camera sees, within reason.
TriangleMesh make_ground(const Scene& scene, const Axes& axes, const Vector& center, double height, double radius) {
    const Camera& c = scene.camera;
    const double above = dot(vector(c.eye), axes.up) - height;
    double reach = 4 * radius;
    for (const double u : {-1.0, 1.0})
        for (const double v : {-1.0, 1.0}) {
            const Vector direction = vector(c.forward) + u * vector(c.right) + v * vector(c.up);
            const double down = -dot(direction, axes.up);
            const Vector hit = vector(c.eye) + (down > 0 ? above / down : INFINITY) * direction;
            const double distance = length(hit - center);
            reach = std::max(reach, std::isfinite(distance) ? 1.1 * distance : INFINITY);
        }
    reach = std::min(reach, largest_ground * radius);
    const Vector middle = center + (height - dot(center, axes.up)) * axes.up;
    constexpr uint32_t corners = 96;
    TriangleMesh mesh;
    mesh.positions.push_back(float3(middle));
    for (uint32_t i = 0; i < corners; ++i) {
        const double angle = 2 * pi * i / corners;
        mesh.positions.push_back(float3(middle + reach * (std::cos(angle) * axes.front + std::sin(angle) * axes.side)));
        mesh.triangles.push_back({0, i + 1, (i + 1) % corners + 1});
    }
    return mesh;
}

// A square of light, up at the viewer's left in front, facing the object.
TriangleMesh make_key_light(const Framing& view, const Axes& axes, const Vector& center, double radius) {
    const Vector towards_viewer = unit(view.to_camera - dot(view.to_camera, axes.up) * axes.up);
    const Vector direction = unit(0.9 * axes.up - 0.85 * view.right + 0.55 * towards_viewer);
    const Vector middle = center + 3.2 * radius * direction;
    const Vector x = 0.9 * radius * unit(cross(axes.up, direction)), y = cross(direction, x);
    TriangleMesh mesh;
    for (const auto& [i, j] : {std::pair(-1.0, -1.0), {-1.0, 1.0}, {1.0, 1.0}, {1.0, -1.0}}) mesh.positions.push_back(float3(middle + i * x + j * y));
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    return mesh;
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
        if (mesh.material) shape.material = static_cast<uint32_t>(scene.materials.size());
        if (mesh.material) scene.materials.push_back(*mesh.material);
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

// Sun and sky, as on a clear afternoon; the sun stands at the viewer's left.
void light_landscape(const Framing& view, const Axes& axes, Scene& scene) {
    const Vector away = unit(view.to_camera - dot(view.to_camera, axes.up) * axes.up);
    const Vector sun = unit(0.8 * axes.up - 0.8 * view.right + 0.25 * away);
    rp_light light{};
    light.kind = RP_LIGHT_DISTANT;
    for (size_t a = 0; a < 3; ++a) light.p[a] = static_cast<float>(sun[a]);
    constexpr float irradiance[3] = {2.9f, 2.6f, 2.15f};
    std::copy(std::begin(irradiance), std::end(irradiance), light.radiance);
    scene.lights = {infinite_light({0.42f, 0.55f, 0.75f}), light};
}

// A lamp over the object, a dim sky, and something to stand on.
void light_object(const Inputs& inputs, const Framing& view, const Axes& axes, double scale, Scene& scene) {
    const double radius = scale * inputs.survey.radius();
    const Vector center = scale * inputs.survey.center();
    const auto lamp = static_cast<uint32_t>(scene.area_lights.size());
    scene.area_lights.push_back({{9.5f, 9.0f, 8.2f}, false});
    scene.lights = {infinite_light({0.22f, 0.25f, 0.30f})};
    const auto add = [&](const char* name, TriangleMesh mesh, uint32_t material, std::optional<uint32_t> light) {
        Shape shape;
        shape.name = name;
        shape.material = material;
        shape.area_light = light;
        shape.mesh = in_memory(name, std::move(mesh));
        scene.shapes.push_back(std::move(shape));
    };
    // A little below the object, so that a flat underside and the ground do not coincide; points reach down further.
    const double below = inputs.clouds.empty() ? 1e-4 : 1e-2;
    const double height = scale * dot(inputs.survey.lower, axes.up) - below * radius;
    add("ground", make_ground(scene, axes, center, height, radius), 1, std::nullopt);
    add("key light", make_key_light(view, axes, center, radius), 2, lamp);
}

}  // namespace

Result<Scene> import_bare(const std::vector<std::filesystem::path>& paths, uint64_t keep_bytes, const PointColumns& columns) {
    Scene scene;
    Inputs inputs{
        {}, {}, {}, {}, {}, Framing(y_up, object_elevation, scene.width, scene.height), Framing(z_up, object_elevation, scene.width, scene.height)};
    RAYPAGER_TRY(open_clouds(paths, columns, inputs));
    const bool landscape = inputs.cloud.landscape;
    if (landscape) inputs.from_z = Framing(z_up, landscape_elevation, scene.width, scene.height);
    frame_clouds(inputs);
    const auto mesh_files = open_mesh_files(paths);
    if (!mesh_files) return mesh_files.status();
    inputs.origin = common_origin(inputs, *mesh_files);
    RAYPAGER_TRY(look_at_meshes(*mesh_files, keep_bytes, inputs));
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
    scene.materials = {diffuse_material({0.70f, 0.61f, 0.53f}), diffuse_material({0.40f, 0.38f, 0.35f}), absorbing_material()};
    add_objects(inputs, scale, scene);
    if (landscape)
        light_landscape(view, axes, scene);
    else
        light_object(inputs, view, axes, scale, scene);
    RAYPAGER_TRY(validate(scene));
    return scene;
}

}  // namespace raypager
