#include "import/bare_meshes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "import/materials.hpp"
#include "import/mesh_file.hpp"

namespace raypager {
namespace {

using Vector = std::array<double, 3>;
constexpr double pi = 3.14159265358979323846;

Vector operator+(const Vector& a, const Vector& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }
Vector operator-(const Vector& a, const Vector& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
Vector operator*(double s, const Vector& v) { return {s * v[0], s * v[1], s * v[2]}; }
double dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Vector cross(const Vector& a, const Vector& b) { return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]}; }
double length(const Vector& v) { return std::hypot(v[0], v[1], v[2]); }
Vector unit(const Vector& v) { return (1 / length(v)) * v; }
Vector vector(const Float3& p) { return {p.x, p.y, p.z}; }
Float3 float3(const Vector& v) { return {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])}; }

// The view: from 30 degrees to the right of the front and 22 degrees above, with a normal to slightly long lens.
constexpr double azimuth = 30 * pi / 180, elevation = 22 * pi / 180, field_of_view = 35;
constexpr double filled = 0.88;              // of the frame, in the direction in which the object is larger
constexpr double largest_ground = 40;        // in radii of the object
constexpr double largest_coordinate = 1e18;  // its square is a float with room to spare
constexpr uint64_t kept_bytes = uint64_t{512} << 20;

// The world as the viewer's: up, towards the viewer's side of the object, and to the viewer's right.
struct Axes {
    Vector up, front, side;
};
constexpr Axes y_up = {{0, 1, 0}, {0, 0, 1}, {1, 0, 0}};
constexpr Axes z_up = {{0, 0, 1}, {0, -1, 0}, {1, 0, 0}};

// Finds the camera position from which a set of points fills the frame, given the direction to it. A point is inside the frame's left and
// right planes if |x - camera x| <= t (distance - z), so the two largest values of +-x / t + z decide; the same for y.
class Framing {
public:
    Framing(const Axes& axes, uint32_t width, uint32_t height) {
        to_camera = unit(std::cos(elevation) * (std::cos(azimuth) * axes.front + std::sin(azimuth) * axes.side) + std::sin(elevation) * axes.up);
        right = unit(cross(axes.up, to_camera));
        up = cross(to_camera, right);
        const double t = filled * std::tan(field_of_view * pi / 360) / std::min(width, height);
        tan_x = t * width;
        tan_y = t * height;
    }

    void add(const Vector& p) {
        const double x = dot(p, right) / tan_x, y = dot(p, up) / tan_y, z = dot(p, to_camera);
        largest = {std::max(largest[0], x + z), std::max(largest[1], z - x), std::max(largest[2], y + z), std::max(largest[3], z - y)};
        nearest = std::max(nearest, z);
    }

    Vector eye(double radius) const {
        const double across = (largest[0] + largest[1]) / 2, upright = (largest[2] + largest[3]) / 2;
        const double distance = std::max({across, upright, nearest + 0.1 * radius});
        return tan_x * (largest[0] - largest[1]) / 2 * right + tan_y * (largest[2] - largest[3]) / 2 * up + distance * to_camera;
    }

    Vector to_camera, right, up;

private:
    double tan_x, tan_y;
    std::array<double, 4> largest = {-INFINITY, -INFINITY, -INFINITY, -INFINITY};
    double nearest = -INFINITY;
};

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

// bounds: of this mesh alone; several meshes may stand side by side.
void survey_areas(const TriangleMesh& mesh, const Survey& bounds, Survey& survey) {
    for (const Triangle& t : mesh.triangles) {
        const Vector p[3] = {vector(mesh.positions[t[0]]), vector(mesh.positions[t[1]]), vector(mesh.positions[t[2]])};
        const Vector area = 0.5 * cross(p[1] - p[0], p[2] - p[0]);
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

struct LoadedMeshes {
    std::vector<std::shared_ptr<const MeshFile>> files;
    Survey survey;
    Framing from_y, from_z;
};

Status load_all(const std::vector<std::filesystem::path>& paths, LoadedMeshes& loaded) {
    uint64_t kept = 0;
    for (const auto& path : paths) {
        const auto file = MeshFile::open(path);
        if (!file) return file.status();
        loaded.files.push_back(*file);
        TriangleMesh mesh;
        MeshIssues issues;
        RAYPAGER_TRY((*file)->load(mesh, issues));
        if (mesh.triangles.empty())
            return Status::failed(fmt::format("{}: has no triangle that can be seen{}", path.string(), issues.any() ? ": " + issues.describe() : ""));
        Survey own;
        survey_bounds(mesh, own);
        for (size_t a = 0; a < 3; ++a) {
            if (std::max(-own.lower[a], own.upper[a]) > largest_coordinate)
                return Status::failed(fmt::format("{}: has coordinates beyond {:g}; scale it down", path.string(), largest_coordinate));
            loaded.survey.lower[a] = std::min(loaded.survey.lower[a], own.lower[a]);
            loaded.survey.upper[a] = std::max(loaded.survey.upper[a], own.upper[a]);
        }
        survey_areas(mesh, own, loaded.survey);
        for (const Triangle& t : mesh.triangles)
            for (const uint32_t index : t) {
                loaded.from_y.add(vector(mesh.positions[index]));
                loaded.from_z.add(vector(mesh.positions[index]));
            }
        const uint64_t bytes = mesh.positions.size() * sizeof(Float3) * 2 + mesh.triangles.size() * sizeof(Triangle);
        if (kept + bytes > kept_bytes) continue;
        kept += bytes;
        (*file)->keep_for_next_load(std::move(mesh), issues);
    }
    return {};
}

// Far from the sizes that single precision is good for, the world is scaled, by a power of two so that no coordinate is rounded.
double world_scale(double radius) { return radius >= 1e-3 && radius <= 1e6 ? 1.0 : std::exp2(-std::round(std::log2(radius))); }

}  // namespace

Result<Scene> import_bare_meshes(const std::vector<std::filesystem::path>& paths) {
    Scene scene;
    LoadedMeshes loaded{{}, {}, Framing(y_up, scene.width, scene.height), Framing(z_up, scene.width, scene.height)};
    RAYPAGER_TRY(load_all(paths, loaded));

    const Survey& survey = loaded.survey;
    const bool z_is_up = stands_on_z(survey);
    const Axes& axes = z_is_up ? z_up : y_up;
    const Framing& view = z_is_up ? loaded.from_z : loaded.from_y;
    const double scale = world_scale(survey.radius()), radius = scale * survey.radius();
    const Vector center = scale * survey.center(), eye = scale * view.eye(survey.radius());
    const auto camera = make_camera(float3(eye), float3(eye - radius * view.to_camera), float3(axes.up), field_of_view, scene.width, scene.height);
    if (!camera) return Status::failed(paths.front().string() + ": cannot be framed; its extent is too small for its distance from the origin");
    scene.camera = *camera;

    // Light clay on a warm grey ground, under a warm key light and a dim bluish sky.
    scene.materials = {diffuse_material({0.70f, 0.61f, 0.53f}), diffuse_material({0.40f, 0.38f, 0.35f}), absorbing_material()};
    scene.area_lights = {AreaLight{{9.5f, 9.0f, 8.2f}, false}};
    scene.lights = {infinite_light({0.22f, 0.25f, 0.30f})};
    for (const auto& file : loaded.files) {
        Shape shape;
        shape.name = file->name();
        shape.to_world = Transform::scale(scale, scale, scale);
        shape.mesh = file;
        scene.shapes.push_back(std::move(shape));
    }
    const auto add = [&](const char* name, TriangleMesh mesh, uint32_t material, std::optional<uint32_t> light) {
        Shape shape;
        shape.name = name;
        shape.material = material;
        shape.area_light = light;
        shape.mesh = in_memory(name, std::move(mesh));
        scene.shapes.push_back(std::move(shape));
    };
    // A little below the object, so that a flat underside and the ground do not coincide.
    const double height = scale * dot(survey.lower, axes.up) - 1e-4 * radius;
    add("ground", make_ground(scene, axes, center, height, radius), 1, std::nullopt);
    add("key light", make_key_light(view, axes, center, radius), 2, 0);
    RAYPAGER_TRY(validate(scene));
    return scene;
}

}  // namespace raypager
