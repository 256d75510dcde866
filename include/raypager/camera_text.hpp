// Cameras as people write them, and as 'inspect' and reports print them: what is printed can be given to --camera, and shows the same picture.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>

#include "raypager/scene.hpp"
#include "raypager/status.hpp"

namespace raypager {

// A camera of the real world: what lies to its right is at the right of the picture. Mirrored, it is at the left. Most .pbrt scenes are mirrored,
// since pbrt's LookAt is left-handed.
struct CameraText {
    Float3 eye;
    std::array<double, 3> target = {}, up = {};
    double fov_degrees = 0;  // of the shorter side of the picture
    bool mirrored = false;
    float lens_radius = 0, focal_distance = 0;  // a thin lens, in focus at that distance ahead; 0: none
    bool operator==(const CameraText&) const = default;
};

// "eye,target,up,fov": ten numbers with commas between them, and perhaps ",mirrored" behind them, and perhaps ",lens," and two numbers more, its
// radius and the distance at which it is in focus. The camera must have a direction: eye and target differ, up is not along the line between them.
Result<CameraText> parse_camera(std::string_view text);
std::string format_camera(const CameraText& camera);  // parse_camera gives the same back, to the last bit

// Nothing if it has no direction.
std::optional<Camera> make_camera(const CameraText& text, uint32_t width, uint32_t height);

// The text that makes this camera, to the last bit wherever there is one; otherwise to single precision. The target lies `distance` from the eye.
// Nothing for a camera that no text describes: it is no perspective, its axes are not at right angles, or its pixels not square.
std::optional<CameraText> describe_camera(const Camera& camera, uint32_t width, uint32_t height, double distance = 1);

// The axis of the world that stands upright in the picture, as up does in LookAt; the camera's own up if none does.
std::array<double, 3> upright_axis(const Camera& camera);
// What --camera takes to look as this one does at something around center; empty if no text describes it.
std::string camera_string(const Camera& camera, uint32_t width, uint32_t height, const std::array<double, 3>& center);

}  // namespace raypager
