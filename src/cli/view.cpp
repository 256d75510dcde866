#include "cli/view.hpp"

#include <cmath>

namespace raypager {
namespace {

double length(const Float3& v) { return std::sqrt(double(v.x) * v.x + double(v.y) * v.y + double(v.z) * v.z); }

Float3 with_length(const Float3& v, double wanted) {
    const double old = length(v), factor = old > 0 ? wanted / old : 0;
    return {static_cast<float>(v.x * factor), static_cast<float>(v.y * factor), static_cast<float>(v.z * factor)};
}

Camera fit_camera(Camera camera, uint32_t scene_width, uint32_t scene_height, uint32_t width, uint32_t height) {
    if (uint64_t(width) * scene_height == uint64_t(height) * scene_width) return camera;
    const double shorter = scene_width <= scene_height ? length(camera.right) : length(camera.up);
    const double sides = double(width) / height;
    camera.right = with_length(camera.right, shorter * std::max(1.0, sides));
    camera.up = with_length(camera.up, shorter * std::max(1.0, 1 / sides));
    return camera;
}

// Whether right is forward x up, as in the real world, and not its opposite.
bool is_right_handed(const Camera& camera) {
    const Float3 &f = camera.forward, &u = camera.up, &r = camera.right;
    const double x = double(f.y) * u.z - double(f.z) * u.y, y = double(f.z) * u.x - double(f.x) * u.z, z = double(f.x) * u.y - double(f.y) * u.x;
    return x * r.x + y * r.y + z * r.z > 0;
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
    parser.option("camera", "EYE,TARGET,UP,FOV",
                  "ten numbers x,y,z,x,y,z,x,y,z,degrees; the field of view is that of the shorter side "
                  "(default: the scene's camera)",
                  into(camera, parse_camera));
}

Result<Camera> choose_camera(const std::optional<CameraText>& given, const Camera& of_scene, uint32_t scene_width, uint32_t scene_height,
                             uint32_t width, uint32_t height) {
    if (!given) return fit_camera(of_scene, scene_width, scene_height, width, height);
    const auto camera = make_camera(given->eye, given->target, given->up, given->fov_degrees, width, height, is_right_handed(of_scene));
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

}  // namespace raypager
