#include "cli/view.hpp"

#include <cmath>
#include <numbers>

#include "cli/values.hpp"
#include "scene/vector.hpp"

namespace raypager {
namespace {

// About an axis through the origin (Rodrigues).
Vector rotated(const Vector& v, const Vector& axis, double angle) {
    const double c = std::cos(angle), s = std::sin(angle);
    return c * v + s * cross(axis, v) + (1 - c) * dot(axis, v) * axis;
}

// Where a point is in a picture: how far from its middle, 1 being the nearer border, as a share of how far ahead.
struct Sighting {
    double aside, ahead;
};

Sighting sighting(const Camera& camera, const Vector& point) {
    const auto along = [&](const Float3& axis) { return dot(point - vector(camera.eye), vector(axis)) / dot(vector(axis), vector(axis)); };
    return {std::max(std::abs(along(camera.right)), std::abs(along(camera.up))), along(camera.forward)};
}

template <typename Do>
void for_each_corner(std::span<const Box> boxes, const Do& with) {
    for (const Box& box : boxes)
        for (int corner = 0; corner < 8; corner++)
            with(Vector{(corner & 1 ? box.upper : box.lower)[0], (corner & 2 ? box.upper : box.lower)[1], (corner & 4 ? box.upper : box.lower)[2]});
}

}  // namespace

void add_view_options(OptionParser& parser, uint32_t& width, uint32_t& height, std::optional<CameraText>& camera) {
    parser.option("size", "WxH", "pixels of the picture (default: as the scene says)", [&width, &height](const std::string& text) -> Status {
        const auto size = parse_image_size(text);
        if (!size) return size.status();
        width = size->width;
        height = size->height;
        return {};
    });
    parser.option(
        "camera", "EYE,TARGET,UP,FOV",
        "ten numbers x,y,z,x,y,z,x,y,z,degrees; the field of view is that of the shorter side; with ',mirrored' behind them left and right are "
        "exchanged, as in most .pbrt scenes; ',lens,RADIUS,DISTANCE' at the end is a thin lens and the distance at which it is in focus; 'inspect' "
        "and reports print cameras in this form (default: the scene's camera)",
        into(camera, parse_camera));
}

Result<Camera> choose_camera(const std::optional<CameraText>& given, const Camera& of_scene, uint32_t scene_width, uint32_t scene_height,
                             uint32_t width, uint32_t height) {
    if (!given) return fit_camera(of_scene, scene_width, scene_height, width, height);
    const auto camera = make_camera(*given, width, height);
    if (!camera) return Status::usage("--camera: has no direction; give other points");
    return *camera;
}

Status set_view(const View& view, Scene& scene) {
    const uint32_t width = view.width ? view.width : scene.width, height = view.height ? view.height : scene.height;
    const auto camera = choose_camera(view.camera, scene.camera, scene.width, scene.height, width, height);
    if (!camera) return camera.status();
    scene.camera = *camera;
    scene.width = width;
    scene.height = height;
    return {};
}

Camera turned_camera(const Camera& camera, const std::array<double, 3>& center, const std::array<double, 3>& upright, double turns) {
    if (turns == 0) return camera;
    const Vector axis = unit(upright);
    const auto turned = [&](const Float3& v) { return float3(rotated(vector(v), axis, 2 * std::numbers::pi * turns)); };
    Camera result = camera;
    result.eye = float3(center + rotated(vector(camera.eye) - center, axis, 2 * std::numbers::pi * turns));
    result.right = turned(camera.right);
    result.up = turned(camera.up);
    result.forward = turned(camera.forward);
    return result;
}

Camera stand_back_for_turns(const Camera& camera, const std::array<double, 3>& center, const std::array<double, 3>& upright, uint32_t count,
                            std::span<const Box> boxes) {
    if (camera.projection != Projection::perspective) return camera;  // from farther back it would not see more
    double border = 1;  // boxes are larger than what is in them, so the first picture need not hold all of their corners
    for_each_corner(boxes, [&](const Vector& p) {
        const Sighting seen = sighting(camera, p);
        border = std::max(border, seen.ahead > 0 ? seen.aside / seen.ahead : INFINITY);
    });
    if (!std::isfinite(border)) return camera;
    const uint32_t views = std::min(count, 72u);  // between them nothing changes much
    double step = 0;
    for (uint32_t i = 1; i < views; i++) {
        const Camera turned = turned_camera(camera, center, upright, static_cast<double>(i) / views);
        for_each_corner(boxes, [&](const Vector& p) {
            const Sighting seen = sighting(turned, p);
            step = std::max(step, seen.aside / border - seen.ahead);
        });
    }
    Camera moved = camera;
    moved.eye = float3(vector(camera.eye) - step * vector(camera.forward));
    return moved;
}

}  // namespace raypager
