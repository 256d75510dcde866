#include "import/scene_framing.hpp"

#include <algorithm>
#include <cmath>

#include "import/bare_look.hpp"
#include "raypager/materials.hpp"

namespace raypager {
namespace {

constexpr double elevation = 22;  // degrees, as of bare meshes
// So many vertices are framed as they are; of more, the corners of boxes around them.
constexpr uint64_t most_points = uint64_t{1} << 23;

Scene& with_picture_of(const BareLook& look, bool has_camera, Scene& scene) {
    if (!has_camera && look.width > 0 && look.height > 0) {
        scene.width = look.width;
        scene.height = look.height;
    }
    return scene;
}

void extend(const Vector& p, Vector& lower, Vector& upper) {
    for (size_t a = 0; a < 3; ++a) {
        lower[a] = std::min(lower[a], p[a]);
        upper[a] = std::max(upper[a], p[a]);
    }
}

}  // namespace

SceneFraming::SceneFraming(const Axes& axes, const BareLook& look, bool has_camera, Scene& scene)
    : axes_(axes),
      look_(look),
      has_camera_(has_camera),
      scene_(with_picture_of(look, has_camera, scene)),
      framing_(axes, elevation, scene.width, scene.height) {}

std::vector<Vector> SceneFraming::corners_of(const std::vector<Vector>& points) const {
    Vector lower = lower_, upper = upper_;
    lower.fill(INFINITY);
    upper.fill(-INFINITY);
    for (const Vector& p : points) extend(p, lower, upper);
    std::vector<Vector> corners;
    for (int i = 0; i < 8; ++i) corners.push_back({i & 1 ? upper[0] : lower[0], i & 2 ? upper[1] : lower[1], i & 4 ? upper[2] : lower[2]});
    return corners;
}

void SceneFraming::add(std::vector<Vector> points, const std::vector<Transform>& places) {
    if (points.size() > 8 && points.size() * places.size() > most_points - points_) points = corners_of(points);
    points_ = std::min(most_points, points_ + points.size() * places.size());
    for (const Transform& place : places)
        for (const Vector& p : points) {
            const Vector placed = place.point(p[0], p[1], p[2]);
            extend(placed, lower_, upper_);
            framing_.add(placed);
        }
}

Status SceneFraming::finish(bool has_light, uint32_t ground_material) {
    if (!(lower_[0] <= upper_[0])) return Status::failed("has no triangle that can be seen");
    const Vector center = 0.5 * (lower_ + upper_);
    const double radius = 0.5 * length(upper_ - lower_);
    if (!std::isfinite(radius)) return Status::failed("is too large to be framed");
    if (!has_camera_) {
        const Vector eye = framing_.eye(radius);
        const auto camera =
            make_camera(float3(eye), float3(eye - radius * framing_.to_camera), float3(axes_.up), field_of_view, scene_.width, scene_.height);
        if (!camera) return Status::failed("cannot be framed; its extent is too small for its distance from the origin");
        scene_.camera = *camera;
    }
    if (has_light) return {};
    BareLook lit = look_;
    lit.no_ground = look_.no_ground || has_camera_;
    const BareSubject subject = {center, radius, axes_.up[1] != 0 ? lower_[1] : lower_[2], false, false};
    light_bare_scene(lit, subject, framing_, axes_, ground_material, scene_);
    return {};
}

Status complete_scene(const BareLook& look, const SceneParts& parts, std::span<const std::array<double, 3>> points, Scene& scene) {
    SceneFraming framing(parts.z_up ? z_up : y_up, look, parts.camera, scene);
    framing.add(std::vector<Vector>(points.begin(), points.end()), {Transform()});
    const auto ground = static_cast<uint32_t>(scene.materials.size());
    if (!parts.light) scene.materials.push_back(bare_ground_material());
    return framing.finish(parts.light, ground);
}

}  // namespace raypager
