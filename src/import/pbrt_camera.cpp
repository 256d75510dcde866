#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "import/pbrt_reader.hpp"
#include "import/text.hpp"

namespace raypager {

Status PbrtReader::camera(const Directive& directive) {
    std::string type;
    PbrtParameters parameters = no_parameters();
    RAYPAGER_TRY(take_type_and_parameters(type, parameters));
    if (type != "perspective") warn(directive.location, fmt::format("Camera \"{}\" is not supported; a perspective camera is used", clipped(type)));
    CameraSettings settings;
    settings.fov = parameters.number("fov", settings.fov);
    settings.shutter_seconds = parameters.number("shutterclose", 1) - parameters.number("shutteropen", 0);
    RAYPAGER_TRY(parameters.status());
    if (!(settings.fov > 0 && settings.fov < 180))
        return error(directive, fmt::format("a field of view of {} degrees; it must be between 0 and 180", settings.fov));
    warn_if_present(parameters, {"screenwindow", "frameaspectratio"}, "the frame is that of the picture's resolution");
    if (parameters.number("lensradius", 0) > 0) warn(directive.location, "Camera: a lens is not supported; everything is in focus");
    if (type == "perspective") warn_of_unused(directive, type, parameters, {"focaldistance"});
    RAYPAGER_TRY(parameters.status());
    if (version_ == 4 && !(settings.shutter_seconds > 0))
        return error(directive, "its shutter does not open: shutterclose must be after shutteropen");
    if (!(settings.shutter_seconds > 0)) settings.shutter_seconds = 1;  // of version 3, where it does not matter
    const auto camera_to_world = state_.transform.inverse();
    if (!camera_to_world) return error(directive, "the transform from world to camera cannot be inverted");
    settings.camera_to_world = *camera_to_world;
    coordinate_systems_["camera"] = *camera_to_world;
    camera_ = settings;
    return {};
}

Status PbrtReader::sampler(const Directive&) {
    std::string type;
    PbrtParameters parameters = no_parameters();
    RAYPAGER_TRY(take_type_and_parameters(type, parameters));
    constexpr uint32_t most = 1u << 24;
    if (type == "stratified" && !parameters.find("pixelsamples")) {
        const uint64_t samples = uint64_t{parameters.count("xsamples", 4, most)} * parameters.count("ysamples", 4, most);
        scene_.spp = static_cast<uint32_t>(std::clamp<uint64_t>(samples, 1, most));
    } else {
        scene_.spp = std::max(1u, parameters.count("pixelsamples", 16, most));
    }
    return parameters.status();
}

Status PbrtReader::integrator(const Directive& directive) {
    std::string type;
    PbrtParameters parameters = no_parameters();
    RAYPAGER_TRY(take_type_and_parameters(type, parameters));
    if (type != "path" && type != "volpath" && type != "simplepath")
        warn(directive.location, fmt::format("Integrator \"{}\" is not supported; path tracing is used", clipped(type)));
    scene_.max_depth = parameters.count("maxdepth", 5, 1u << 20);
    return parameters.status();
}

// pbrt's camera looks along +z of a left-handed space, +x to the right; the field of view is that of the picture's shorter side.
Status PbrtReader::place_camera() {
    const CameraSettings settings = camera_.value_or(CameraSettings());
    const double half = std::tan(settings.fov * (3.14159265358979323846 / 360));
    const double shorter = std::min(scene_.width, scene_.height);
    const auto float3 = [](const std::array<double, 3>& v) {
        return Float3{static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
    };
    const Transform& c = settings.camera_to_world;
    scene_.camera.eye = float3(c.point(0, 0, 0));
    scene_.camera.right = float3(c.vector(half * scene_.width / shorter, 0, 0));
    scene_.camera.up = float3(c.vector(0, half * scene_.height / shorter, 0));
    scene_.camera.forward = float3(c.vector(0, 0, 1));
    return {};
}

}  // namespace raypager
