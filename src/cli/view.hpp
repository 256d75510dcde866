// Which camera looks at a scene: the one that was asked for, or the scene's own, for a picture of any shape.
#pragma once

#include <optional>
#include <span>
#include <string>

#include "cli/option_parser.hpp"
#include "raypager/camera_text.hpp"
#include "raypager/scene.hpp"
#include "scene/box.hpp"

namespace raypager {

// Size and camera as given on the command line.
struct View {
    uint32_t width = 0, height = 0;  // 0: the scene's
    std::optional<CameraText> camera;
};

// The options --size and --camera.
void add_view_options(OptionParser& parser, uint32_t& width, uint32_t& height, std::optional<CameraText>& camera);

// For a picture of width x height. A given camera is that of the real world, or mirrored if it says so, whatever the scene's is. Without one the
// scene's camera, made for a picture of scene_width x scene_height, is fitted: the field of view of the shorter side stays, pixels are square.
Result<Camera> choose_camera(const std::optional<CameraText>& given, const Camera& of_scene, uint32_t scene_width, uint32_t scene_height,
                             uint32_t width, uint32_t height);

// Makes the view the scene's own.
Status set_view(const View& view, Scene& scene);

// A camera on a circle around something, `turns` of a whole turn on; upright: the axis.
Camera turned_camera(const Camera& camera, const std::array<double, 3>& center, const std::array<double, 3>& upright, double turns);

// The camera moved back so far that none of `count` pictures all around shows less of these boxes than its own picture or all of them do. It stays
// where it is if some of them is behind it.
Camera stand_back_for_turns(const Camera& camera, const std::array<double, 3>& center, const std::array<double, 3>& upright, uint32_t count,
                            std::span<const Box> boxes);

}  // namespace raypager
