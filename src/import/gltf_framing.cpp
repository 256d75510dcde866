#include "import/gltf_framing.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "import/bare_look.hpp"
#include "import/framing.hpp"
#include "raypager/materials.hpp"
#include "scene/vector.hpp"

namespace raypager {
namespace {

constexpr double elevation = 22;  // degrees, as of bare meshes
// So many vertices are framed as they are; of more, the corners of boxes around them.
constexpr uint64_t most_points = uint64_t{1} << 23;

struct Bounds {
    Vector lower = {INFINITY, INFINITY, INFINITY}, upper = {-INFINITY, -INFINITY, -INFINITY};
    void add(const Vector& p) {
        for (size_t a = 0; a < 3; ++a) {
            lower[a] = std::min(lower[a], p[a]);
            upper[a] = std::max(upper[a], p[a]);
        }
    }
    bool empty() const { return !(lower[0] <= upper[0]); }
    std::vector<Vector> corners() const {
        std::vector<Vector> points;
        for (int i = 0; i < 8 && !empty(); ++i)
            points.push_back({i & 1 ? upper[0] : lower[0], i & 2 ? upper[1] : lower[1], i & 4 ? upper[2] : lower[2]});
        return points;
    }
};

class GltfSurvey {
public:
    explicit GltfSurvey(Framing& framing) : framing_(framing) {}

    Status add(const MeshSource& source, const std::vector<Transform>& places) {
        TriangleMesh mesh;
        MeshIssues ignored;
        RAYPAGER_TRY(source.load(mesh, ignored));
        std::vector<bool> used(mesh.positions.size(), false);
        for (const Triangle& t : mesh.triangles)
            for (const uint32_t v : t) used[v] = true;
        std::vector<Vector> points;
        for (size_t i = 0; i < used.size(); ++i)
            if (used[i]) points.push_back(vector(mesh.positions[i]));
        add(std::move(points), places);
        return {};
    }

    void add(std::vector<Vector> points, const std::vector<Transform>& places) {
        if (points.size() > 8 && points.size() * places.size() > most_points - points_) {
            Bounds own;
            for (const Vector& p : points) own.add(p);
            points = own.corners();
        }
        points_ = std::min(most_points, points_ + points.size() * places.size());
        for (const Transform& place : places)
            for (const Vector& p : points) {
                const Vector placed = place.point(p[0], p[1], p[2]);
                bounds.add(placed);
                framing_.add(placed);
            }
    }

    Bounds bounds;

private:
    Framing& framing_;
    uint64_t points_ = 0;
};

Status add_cloud(const Shape& shape, GltfSurvey& survey) {
    std::vector<Vector> points;
    MeshIssues ignored;
    RAYPAGER_TRY(shape.points->stream(
        [&](std::span<const CloudPoint> some) {
            for (const CloudPoint& p : some) points.push_back(vector(p.position));
            return Status();
        },
        ignored));
    survey.add(std::move(points), {shape.to_world});
    return {};
}

}  // namespace

Status frame_gltf(const GltfModel& model, const BareLook& look, bool has_camera, bool has_light, const std::vector<GltfPlaced>& placed,
                  Scene& scene) {
    if (!has_camera && look.width > 0 && look.height > 0) {
        scene.width = look.width;
        scene.height = look.height;
    }
    Framing framing(y_up, elevation, scene.width, scene.height);
    GltfSurvey survey(framing);
    for (const GltfPlaced& some : placed)
        for (const auto& mesh : some.meshes) RAYPAGER_TRY(survey.add(*mesh, some.places));
    for (const Shape& shape : scene.shapes)
        if (shape.points) RAYPAGER_TRY(add_cloud(shape, survey));
    const Bounds& bounds = survey.bounds;
    if (bounds.empty()) return model.failed("has no triangle that can be seen");
    const Vector center = 0.5 * (bounds.lower + bounds.upper);
    const double radius = 0.5 * length(bounds.upper - bounds.lower);
    if (!std::isfinite(radius)) return model.failed("is too large to be framed");
    if (!has_camera) {
        const Vector eye = framing.eye(radius);
        const auto camera = make_camera(float3(eye), float3(eye - radius * framing.to_camera), {0, 1, 0}, field_of_view, scene.width, scene.height);
        if (!camera) return model.failed("cannot be framed; its extent is too small for its distance from the origin");
        scene.camera = *camera;
    }
    if (has_light) return {};
    BareLook lit = look;
    lit.no_ground = look.no_ground || has_camera;
    constexpr uint32_t ground_material = 0;
    light_bare_scene(lit, {center, radius, bounds.lower[1], false, false}, framing, y_up, ground_material, scene);
    return {};
}

}  // namespace raypager
