#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "import/pbrt_reader.hpp"
#include "import/text.hpp"
#include "scene/vector.hpp"

namespace raypager {

Status PbrtReader::camera(const Directive& directive) {
    std::string type;
    PbrtParameters parameters = no_parameters();
    RAYPAGER_TRY(take_type_and_parameters(type, parameters));
    CameraSettings settings;
    settings.location = directive.location;
    if (type == "environment") seems_version(3);
    if (type == "spherical") seems_version(4);
    if (type == "orthographic") {
        settings.projection = Projection::orthographic;
    } else if (type == "environment") {
        settings.projection = Projection::equirectangular;
    } else if (type == "spherical") {
        const std::string mapping = parameters.text("mapping", "equalarea");
        RAYPAGER_TRY(parameters.status());
        if (mapping != "equalarea" && mapping != "equirectangular")
            return error(directive, fmt::format("there is no mapping \"{}\"; it is equalarea or equirectangular", clipped(mapping)));
        settings.projection = mapping == "equalarea" ? Projection::equal_area : Projection::equirectangular;
    } else if (type != "perspective") {
        warn(directive.location, fmt::format("Camera \"{}\" is not supported; a perspective camera is used", clipped(type)));
    }
    if (const double half = parameters.number("halffov", 0); half > 0) settings.fov = 2 * half;
    settings.fov = parameters.number("fov", settings.fov);
    settings.shutter_seconds = parameters.number("shutterclose", 1) - parameters.number("shutteropen", 0);
    RAYPAGER_TRY(parameters.status());
    if (!(settings.fov > 0 && settings.fov < 180))
        return error(directive, fmt::format("a field of view of {} degrees; it must be between 0 and 180", settings.fov));
    if (type == "perspective" || type == "orthographic") {
        RAYPAGER_TRY(frame(directive, parameters, settings));
        RAYPAGER_TRY(lens(directive, parameters, settings));
    }
    if (type != "realistic") warn_of_unused(directive, type, parameters, {"frameaspectratio", "screenwindow", "lensradius", "focaldistance"});
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

// What of the plane ahead of the camera is the picture. A window whose borders are exchanged mirrors it.
Status PbrtReader::frame(const Directive& directive, const PbrtParameters& parameters, CameraSettings& settings) {
    if (parameters.find("frameaspectratio")) settings.frame_aspect = parameters.number("frameaspectratio", 1);
    RAYPAGER_TRY(parameters.status());
    if (settings.frame_aspect && !(*settings.frame_aspect > 0))
        return error(directive, fmt::format("its frameaspectratio must be more than 0, but it is {}", *settings.frame_aspect));
    const PbrtParameter* const window = parameters.find("screenwindow");
    if (!window) return {};
    const auto& numbers = window->numbers;
    if (numbers.size() != 4) return parameter_error(*window, "expected four numbers: left, right, bottom, top");
    if (numbers[0] == numbers[1] || numbers[2] == numbers[3]) return error(directive, "its screenwindow is empty");
    settings.screen_window = {numbers[0], numbers[1], numbers[2], numbers[3]};
    return {};
}

Status PbrtReader::lens(const Directive& directive, const PbrtParameters& parameters, CameraSettings& settings) {
    settings.lens_radius = parameters.number("lensradius", 0);
    settings.focal_distance = parameters.number("focaldistance", settings.focal_distance);
    RAYPAGER_TRY(parameters.status());
    const auto radius = static_cast<float>(settings.lens_radius), distance = static_cast<float>(settings.focal_distance);
    if (!(radius >= 0) || !std::isfinite(radius))
        return error(directive, fmt::format("its lensradius must be 0 or more, but it is {}", settings.lens_radius));
    if (radius > 0 && (!(distance > 0) || !std::isfinite(distance)))
        return error(directive, fmt::format("its focaldistance must be more than 0, but it is {}", settings.focal_distance));
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

namespace {

Float3 to_float3(const std::array<double, 3>& v) { return {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])}; }

double length_of(const std::array<double, 3>& v) { return std::hypot(v[0], v[1], v[2]); }

}  // namespace

// pbrt's camera looks along +z of a left-handed space, +x to the right; the field of view is that of the picture's shorter side.
Status PbrtReader::place_camera() {
    const CameraSettings settings = camera_.value_or(CameraSettings());
    const Transform& c = settings.camera_to_world;
    Camera& camera = scene_.camera;
    camera.projection = settings.projection;
    camera.eye = to_float3(c.point(0, 0, 0));
    camera.forward = to_float3(c.vector(0, 0, 1));
    if (camera.sees_all_around()) {
        camera.right = to_float3(c.vector(1, 0, 0));
        camera.up = to_float3(c.vector(0, 1, 0));
        crop_camera();
        return {};
    }
    const bool perspective = settings.projection == Projection::perspective;
    const double scale = perspective ? std::tan(settings.fov * (3.14159265358979323846 / 360)) : 1;
    const double shorter = std::min(scene_.width, scene_.height);
    double half_width = scale * scene_.width / shorter, half_height = scale * scene_.height / shorter, x = 0, y = 0;
    if (settings.frame_aspect) {
        half_width = scale * std::max(1.0, *settings.frame_aspect);
        half_height = scale * std::max(1.0, 1 / *settings.frame_aspect);
    }
    if (settings.screen_window) {
        const auto& [left, right, bottom, top] = *settings.screen_window;
        half_width = scale * (right - left) / 2;
        half_height = scale * (top - bottom) / 2;
        x = scale * (left + right) / 2;
        y = scale * (bottom + top) / 2;
    }
    camera.right = to_float3(c.vector(half_width, 0, 0));
    camera.up = to_float3(c.vector(0, half_height, 0));
    if (x != 0 || y != 0) (perspective ? camera.forward : camera.eye) = to_float3(perspective ? c.vector(x, y, 1) : c.point(x, y, 0));
    if (settings.lens_radius > 0) {
        const double across = length_of(c.vector(1, 0, 0)), along = length_of(c.vector(0, 1, 0));
        if (std::abs(across - along) > 1e-3 * across) warn(settings.location, "Camera: a transform stretches its lens; a round one is used");
        camera.lens_radius = static_cast<float>(settings.lens_radius * std::sqrt(across * along));
        camera.focal_distance = static_cast<float>(settings.focal_distance);
    }
    crop_camera();
    for (const Float3& v : {camera.eye, camera.right, camera.up, camera.forward})
        if (!finite(v)) return Status::failed(settings.location.with_line() + ": Camera: its frame is too large to compute with");
    return {};
}

// The picture is a part of the film; each of its pixels sees what it sees in the whole.
void PbrtReader::crop_camera() {
    if (!crop_) return;
    const double width = scene_.width, height = scene_.height;
    const double wide = (crop_->right - crop_->left) / width, high = (crop_->bottom - crop_->top) / height;
    Camera& camera = scene_.camera;
    if (camera.sees_all_around()) {
        camera.window = {static_cast<float>(crop_->left / width), static_cast<float>(crop_->top / height), static_cast<float>(wide),
                         static_cast<float>(high)};
    } else {
        const double x = (crop_->left + crop_->right) / width - 1, y = 1 - (crop_->top + crop_->bottom) / height;
        const auto add = [&](float to, float right, float up) { return static_cast<float>(to + x * right + y * up); };
        Float3& middle = camera.projection == Projection::perspective ? camera.forward : camera.eye;
        const Float3 right = camera.right, up = camera.up;
        middle = {add(middle.x, right.x, up.x), add(middle.y, right.y, up.y), add(middle.z, right.z, up.z)};
        const auto scaled = [](const Float3& v, double by) {
            return Float3{static_cast<float>(by * v.x), static_cast<float>(by * v.y), static_cast<float>(by * v.z)};
        };
        camera.right = scaled(right, wide);
        camera.up = scaled(up, high);
    }
    scene_.width = crop_->right - crop_->left;
    scene_.height = crop_->bottom - crop_->top;
}

}  // namespace raypager
