#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "import/pbrt_reader.hpp"
#include "import/text.hpp"
#include "raypager/materials.hpp"

namespace raypager {
namespace {

constexpr Float3 white{1, 1, 1};

}  // namespace

// A light's colour times its scale, which is a number, or a colour in pbrt-v3. per_power: what pbrt-v4's parameters power or illuminance are
// divided by, as far as they are known to be about this light; otherwise 0.
Status PbrtReader::light_color(const PbrtParameters& parameters, std::string_view name, Float3& result, double per_power) {
    Float3 value, scale;
    RAYPAGER_TRY(color(parameters, {name}, white, value));
    RAYPAGER_TRY(color(parameters, {"scale"}, white, scale));
    result = {value.x * scale.x, value.y * scale.y, value.z * scale.z};
    if (per_power > 0) {
        const double power = parameters.number({"power", "illuminance"}, 0);
        RAYPAGER_TRY(parameters.status());
        const auto factor = static_cast<float>(power / per_power);
        if (power > 0) result = {result.x * factor, result.y * factor, result.z * factor};
    } else {
        warn_if_present(parameters, {"power", "illuminance"}, "the light is as bright as its colour and scale say");
    }
    for (const float x : {result.x, result.y, result.z})
        if (!std::isfinite(x)) return parameter_error(*parameters.find({name, "scale", "power", "illuminance"}), "is too bright to compute with");
    return {};
}

void PbrtReader::add_infinite_light(const Float3& radiance) {
    for (rp_light& light : scene_.lights)
        if (light.kind == RP_LIGHT_INFINITE) {  // constant light from everywhere just adds up
            light.radiance[0] += radiance.x;
            light.radiance[1] += radiance.y;
            light.radiance[2] += radiance.z;
            return;
        }
    scene_.lights.push_back(infinite_light(radiance));
}

Status PbrtReader::light_source(const Directive& directive) {
    std::string type;
    PbrtParameters parameters = no_parameters();
    RAYPAGER_TRY(take_type_and_parameters(type, parameters));
    if (!is_in_world(directive, type)) return {};
    Float3 radiance;
    if (type == "infinite" || type == "exinfinite") {
        RAYPAGER_TRY(light_color(parameters, "L", radiance, std::numbers::pi));
        warn_if_present(parameters, {"filename", "mapname"}, "the sky is white on average");
        warn_if_present(parameters, {"portal"}, "light comes from everywhere");
        add_infinite_light(radiance);
        warn_of_unused(directive, type, parameters, {"samples", "nsamples"});
        return {};
    }
    rp_light light{};
    const auto store = [](const Float3& from, float* to) {
        to[0] = from.x;
        to[1] = from.y;
        to[2] = from.z;
    };
    const auto from = parameters.point("from", {0, 0, 0});
    if (type == "distant") {
        RAYPAGER_TRY(light_color(parameters, "L", radiance, 1));
        const auto to = parameters.point("to", {0, 0, 1});
        auto d = state_.transform.vector(from[0] - to[0], from[1] - to[1], from[2] - to[2]);
        const double length = std::hypot(d[0], d[1], d[2]);
        if (!(length > 0) || !std::isfinite(length)) return error(directive, "\"from\" and \"to\" must be different points");
        light.kind = RP_LIGHT_DISTANT;
        for (size_t i = 0; i < 3; ++i) light.p[i] = static_cast<float>(d[i] / length);
    } else if (type == "point" || type == "spot" || type == "goniometric" || type == "projection") {
        RAYPAGER_TRY(light_color(parameters, "I", radiance, type == "point" ? 4 * std::numbers::pi : 0));
        if (type == "point")
            warn_of_unused(directive, type, parameters, {"samples", "nsamples"});
        else
            warn(directive.location, fmt::format("LightSource \"{}\" is not supported; a point light is used", type));
        const auto p = state_.transform.point(from[0], from[1], from[2]);
        light.kind = RP_LIGHT_POINT;
        for (size_t i = 0; i < 3; ++i) light.p[i] = static_cast<float>(p[i]);
        if (!std::isfinite(light.p[0]) || !std::isfinite(light.p[1]) || !std::isfinite(light.p[2]))
            return error(directive, "its position is not finite");
    } else {
        warn(directive.location, fmt::format("LightSource \"{}\" is not supported; it is left out", clipped(type)));
        return {};
    }
    store(radiance, light.radiance);
    scene_.lights.push_back(light);
    return parameters.status();
}

Status PbrtReader::area_light_source(const Directive& directive) {
    std::string type;
    PbrtParameters parameters = no_parameters();
    RAYPAGER_TRY(take_type_and_parameters(type, parameters));
    if (type != "diffuse" && type != "area") {
        warn(directive.location, fmt::format("AreaLightSource \"{}\" is not supported; its shapes do not shine", clipped(type)));
        state_.area_light.reset();
        return {};
    }
    AreaLight light;
    RAYPAGER_TRY(light_color(parameters, "L", light.radiance));
    warn_if_present(parameters, {"filename"}, "the light is uniform");
    light.two_sided = parameters.boolean("twosided", false);
    warn_of_unused(directive, type, parameters, {"samples", "nsamples"});
    state_.area_light = static_cast<uint32_t>(scene_.area_lights.size());
    scene_.area_lights.push_back(light);
    return parameters.status();
}

}  // namespace raypager
