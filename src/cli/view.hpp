// Which camera looks at a scene: the one that was asked for, or the scene's own, for a picture of any shape.
#pragma once

#include <optional>

#include "cli/option_parser.hpp"
#include "cli/values.hpp"
#include "raypager/scene.hpp"

namespace raypager {

// Size and camera as given on the command line.
struct View {
    uint32_t width = 0, height = 0;  // 0: the scene's
    std::optional<CameraText> camera;
};

// The options --size and --camera.
void add_view_options(OptionParser& parser, uint32_t& width, uint32_t& height, std::optional<CameraText>& camera);

// For a picture of width x height. A given camera keeps the handedness of the scene's, so that the numbers of a .pbrt's LookAt mean here
// what they mean there. Without one the scene's camera, made for a picture of scene_width x scene_height, is fitted: the field of view
// of the shorter side stays, pixels are square.
Result<Camera> choose_camera(const std::optional<CameraText>& given, const Camera& of_scene, uint32_t scene_width, uint32_t scene_height,
                             uint32_t width, uint32_t height);

// Makes the view the scene's own.
Status set_view(const View& view, Scene& scene);

}  // namespace raypager
