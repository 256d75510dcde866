#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "import/pbrt_reader.hpp"
#include "import/text.hpp"
#include "raypager/materials.hpp"
#include "raypager/sky.hpp"
#include "scene/vector.hpp"

namespace raypager {
namespace {

constexpr Float3 white{1, 1, 1};
constexpr double degree = std::numbers::pi / 180;

void put(const Float3& from, float (&to)[3]) {
    to[0] = from.x;
    to[1] = from.y;
    to[2] = from.z;
}

double brightness(const Float3& c) { return 0.2126 * c.x + 0.7152 * c.y + 0.0722 * c.z; }

Float3 scaled(const Float3& c, double factor) {
    const auto f = static_cast<float>(factor);
    return {c.x * f, c.y * f, c.z * f};
}

// So that a light's radiance says how bright it is.
double bring_to_mean_1(Image& image) {
    double sum = 0;
    for (const float value : image.values) sum += value;
    const double mean = sum / static_cast<double>(image.values.size());
    if (!(mean > 0)) return 0;
    for (float& value : image.values) value = static_cast<float>(value / mean);
    return mean;
}

void make_grey(Image& image) {
    if (image.channels != 3) return;
    Image grey{image.width, image.height, 1, {}};
    for (size_t i = 0; i < image.values.size(); i += 3) grey.values.push_back((image.values[i] + image.values[i + 1] + image.values[i + 2]) / 3);
    image = std::move(grey);
}

}  // namespace

// A light's colour times its scale, which is a number, or a colour in pbrt-v3. per_power: what pbrt-v4's parameters power or illuminance are
// divided by, as far as they are known to be about this light; otherwise 0; negative if the caller looks at them.
Status PbrtReader::light_color(const PbrtParameters& parameters, std::string_view name, Float3& result, double per_power) {
    Float3 value, scale;
    RAYPAGER_TRY(color(parameters, {name}, white, value));
    RAYPAGER_TRY(color(parameters, {"scale"}, white, scale));
    result = {value.x * scale.x, value.y * scale.y, value.z * scale.z};
    if (per_power > 0) {
        const double power = parameters.number({"power", "illuminance"}, 0);
        RAYPAGER_TRY(parameters.status());
        if (power > 0) result = scaled(result, power / per_power);
    } else if (per_power == 0) {
        warn_if_present(parameters, {"power", "illuminance"}, "the light is as bright as its colour and scale say");
    }
    for (const float x : {result.x, result.y, result.z})
        if (!std::isfinite(x)) return parameter_error(*parameters.find({name, "scale", "power", "illuminance"}), "is too bright to compute with");
    return {};
}

Status PbrtReader::light_source(const Directive& directive) {
    std::string type;
    PbrtParameters parameters = no_parameters();
    RAYPAGER_TRY(take_type_and_parameters(type, parameters));
    if (!is_in_world(directive, type)) return {};
    const size_t before = scene_.lights.size();
    if (type == "infinite" || type == "exinfinite") {
        RAYPAGER_TRY(infinite_light_source(directive, parameters));
    } else if (type == "distant") {
        RAYPAGER_TRY(distant_light(directive, parameters));
    } else if (type == "point") {
        RAYPAGER_TRY(point_light(directive, parameters));
    } else if (type == "spot") {
        RAYPAGER_TRY(spot_light(directive, parameters));
    } else if (type == "goniometric") {
        RAYPAGER_TRY(goniometric_light(directive, parameters));
    } else if (type == "projection") {
        RAYPAGER_TRY(projection_light(directive, parameters));
    } else {
        warn(directive.location, fmt::format("LightSource \"{}\" is not supported; it is left out", clipped(type)));
        return {};
    }
    if (scene_.lights.size() > before) {
        const rp_light& light = scene_.lights.back();
        if (!std::isfinite(light.p[0]) || !std::isfinite(light.p[1]) || !std::isfinite(light.p[2]))
            return error(directive, "its position is not finite");
    }
    warn_of_unused(directive, type, parameters, {"samples", "nsamples"});
    return parameters.status();
}

Status PbrtReader::infinite_light_source(const Directive& directive, const PbrtParameters& parameters) {
    Float3 radiance;
    const PbrtParameter* file = parameters.find({"filename", "mapname"});
    warn_if_present(parameters, {"portal"}, "light comes from everywhere");
    if (file && file->strings.size() == 1 && file->strings[0].empty()) file = nullptr;
    if (file) return image_sky(directive, parameters, *file);
    RAYPAGER_TRY(light_color(parameters, "L", radiance, std::numbers::pi));
    for (rp_light& light : scene_.lights)
        if (light.kind == RP_LIGHT_INFINITE) {  // constant light from everywhere just adds up
            light.radiance[0] += radiance.x;
            light.radiance[1] += radiance.y;
            light.radiance[2] += radiance.z;
            return {};
        }
    scene_.lights.push_back(infinite_light(radiance));
    return {};
}

Status PbrtReader::distant_light(const Directive& directive, const PbrtParameters& parameters) {
    rp_light light{};
    light.kind = RP_LIGHT_DISTANT;
    Float3 radiance;
    RAYPAGER_TRY(light_color(parameters, "L", radiance, 1));
    const auto from = parameters.point("from", {0, 0, 0}), to = parameters.point("to", {0, 0, 1});
    const Vector d = state_.transform.vector(from[0] - to[0], from[1] - to[1], from[2] - to[2]);
    const double size = std::hypot(d[0], d[1], d[2]);
    if (!(size > 0) || !std::isfinite(size)) return error(directive, "\"from\" and \"to\" must be different points");
    put(float3((1 / size) * d), light.p);
    put(radiance, light.radiance);
    scene_.lights.push_back(light);
    return {};
}

Status PbrtReader::point_light(const Directive&, const PbrtParameters& parameters) {
    rp_light light{};
    light.kind = RP_LIGHT_POINT;
    Float3 intensity;
    RAYPAGER_TRY(light_color(parameters, "I", intensity, 4 * std::numbers::pi));
    const auto from = parameters.point("from", {0, 0, 0});
    put(float3(state_.transform.point(from[0], from[1], from[2])), light.p);
    put(intensity, light.radiance);
    scene_.lights.push_back(light);
    return {};
}

Status PbrtReader::spot_light(const Directive& directive, const PbrtParameters& parameters) {
    rp_light light{};
    light.kind = RP_LIGHT_SPOT;
    const double cone = parameters.number("coneangle", 30), delta = parameters.number("conedeltaangle", 5);
    RAYPAGER_TRY(parameters.status());
    if (!(cone > 0 && cone <= 180)) return error(directive, "its coneangle must be more than 0 and at most 180 degrees");
    // As pbrt has it, negative where the delta is larger than the cone; the cosine is the same.
    const double end = std::cos(cone * degree), full = std::max(end, std::cos((cone - delta) * degree));
    Float3 intensity;
    RAYPAGER_TRY(light_color(parameters, "I", intensity, 2 * std::numbers::pi * ((1 - full) + (full - end) / 2)));
    const auto from = parameters.point("from", {0, 0, 0}), to = parameters.point("to", {0, 0, 1});
    const Vector axis = state_.transform.vector(to[0] - from[0], to[1] - from[1], to[2] - from[2]);
    const double size = std::hypot(axis[0], axis[1], axis[2]);
    if (!(size > 0) || !std::isfinite(size)) return error(directive, "\"from\" and \"to\" must be different points");
    put(float3(state_.transform.point(from[0], from[1], from[2])), light.p);
    put(float3((1 / size) * axis), light.e1);
    light.e2[0] = static_cast<float>(end);
    light.e2[1] = static_cast<float>(full);
    light.e2[2] = version_ == 3 ? 1.0f : 0.0f;  // versions differ in how light fades
    put(intensity, light.radiance);
    scene_.lights.push_back(light);
    return {};
}

// A point light that shines through an image of all directions. Both versions swap y and z before they look at it.
Status PbrtReader::goniometric_light(const Directive& directive, const PbrtParameters& parameters) {
    rp_light light{};
    light.kind = RP_LIGHT_POINT;
    Float3 intensity;
    RAYPAGER_TRY(light_color(parameters, "I", intensity, -1));
    const double power = parameters.number("power", 0);
    put(float3(state_.transform.point(0, 0, 0)), light.p);
    const PbrtParameter* file = parameters.find({"filename", "mapname"});
    double mean = 1;
    if (!file || file->strings.size() != 1 || file->strings[0].empty()) {
        warn(directive.location, "LightSource \"goniometric\" without an image shines alike in all directions");
    } else {
        Image image;
        std::array<Float3, 3> axes;
        RAYPAGER_TRY(read_light_image(directive, *file, image));
        if (file->name == "filename") make_grey(image);
        RAYPAGER_TRY(bring_into_sky(directive, *file, image));
        RAYPAGER_TRY(light_axes(directive, axes));
        mean = bring_to_mean_1(image);
        put(axes[0], light.e1);
        put(axes[2], light.e2);
        if (!state_.transform.swaps_handedness()) light.flags |= RP_LIGHT_MIRRORED;
        RAYPAGER_TRY(add_light_image(directive, image, light));
    }
    put(scaled(intensity, power > 0 ? power / (4 * std::numbers::pi) : mean), light.radiance);
    scene_.lights.push_back(light);
    return {};
}

// A point light that throws an image onto what it shines at, along the z axis.
Status PbrtReader::projection_light(const Directive& directive, const PbrtParameters& parameters) {
    rp_light light{};
    light.kind = RP_LIGHT_PROJECTION;
    Float3 intensity;
    RAYPAGER_TRY(light_color(parameters, "I", intensity, -1));
    const PbrtParameter* file = parameters.find({"filename", "mapname"});
    if (!file || file->strings.size() != 1 || file->strings[0].empty()) return error(directive, "it needs an image, as \"filename\"");
    const bool version_3 = file->name == "mapname";
    const double fov = parameters.number("fov", version_3 ? 45 : 90), power = parameters.number("power", 0);
    RAYPAGER_TRY(parameters.status());
    if (!(fov > 0 && fov < 180)) return error(directive, "its fov must be more than 0 and less than 180 degrees");
    Image image;
    std::array<Float3, 3> axes;
    RAYPAGER_TRY(read_light_image(directive, *file, image));
    RAYPAGER_TRY(light_axes(directive, axes));
    // The field of view spans the shorter side.
    const double half = std::tan(fov / 2 * degree), aspect = double(image.width) / image.height;
    const double right = half * std::max(1.0, aspect), up = half * std::max(1.0, 1 / aspect);
    put(float3(state_.transform.point(0, 0, 0)), light.p);
    put(scaled(axes[0], right), light.e1);
    put(scaled(axes[1], version_3 ? -up : up), light.e2);
    if (state_.transform.swaps_handedness() != version_3) light.flags |= RP_LIGHT_MIRRORED;
    double factor = 1;
    if (power > 0) {
        double sum = 0;
        for (uint32_t y = 0; y < image.height; y++)
            for (uint32_t x = 0; x < image.width; x++) {
                const double s = (2 * (x + 0.5) / image.width - 1) * right, t = (2 * (y + 0.5) / image.height - 1) * up;
                const float* p = &image.values[(size_t{y} * image.width + x) * image.channels];
                sum += (image.channels == 3 ? brightness({p[0], p[1], p[2]}) : p[0]) * std::pow(1 + s * s + t * t, -1.5);
            }
        if (sum > 0) factor = power / (sum * 4 * right * up / (double(image.width) * image.height));
    }
    const double mean = bring_to_mean_1(image);
    RAYPAGER_TRY(add_light_image(directive, image, light));
    put(scaled(intensity, factor * mean), light.radiance);
    scene_.lights.push_back(light);
    return {};
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
    RAYPAGER_TRY(light_color(parameters, "L", light.radiance, -1));
    if (const PbrtParameter* file = parameters.find("filename"); file && file->strings.size() == 1 && !file->strings[0].empty()) {
        Image image;
        RAYPAGER_TRY(read_light_image(directive, *file, image));
        warn(file->location, "the images of area lights are not supported; the light is uniform, of the mean colour of its image");
        const auto packed = light_image_of(image);
        if (!packed) return packed.status().at(file->location.with_line());
        const Float3 mean = mean_color(**packed);
        light.radiance = {light.radiance.x * mean.x, light.radiance.y * mean.y, light.radiance.z * mean.z};
    }
    light.power = static_cast<float>(parameters.number("power", 0));
    RAYPAGER_TRY(parameters.status());
    if (!(light.power > 0)) light.power = 0;
    if (!std::isfinite(light.power)) return error(directive, "its power must be finite");
    light.two_sided = parameters.boolean("twosided", false);
    warn_of_unused(directive, type, parameters, {"samples", "nsamples"});
    state_.area_light = static_cast<uint32_t>(scene_.area_lights.size());
    scene_.area_lights.push_back(light);
    return parameters.status();
}

// A power is that of one of pbrt's shapes: each triangle of a mesh is one, but what we make triangles of is one as a whole.
Status PbrtReader::share_power(const std::string& type, Shape& shape) {
    if (!shape.area_light || !(scene_.area_lights[*shape.area_light].power > 0)) return {};
    const bool made_of_triangles = shape.mesh && (type == "disk" || type == "cylinder" || type == "sphere" || type == "bilinearmesh");
    if (!made_of_triangles) return {};
    TriangleMesh mesh;
    MeshIssues ignored;
    RAYPAGER_TRY(shape.mesh->load(mesh, ignored));
    double area = 0;
    for (const auto& [a, b, c] : mesh.triangles) {
        const auto placed = [&](uint32_t v) -> Vector { return shape.to_world.point(mesh.positions[v].x, mesh.positions[v].y, mesh.positions[v].z); };
        area += length(cross(placed(b) - placed(a), placed(c) - placed(a))) / 2;
    }
    if (!(area > 0)) return {};
    AreaLight light = scene_.area_lights[*shape.area_light];
    light.radiance = scaled(light.radiance, light.power / (std::numbers::pi * area * (light.two_sided ? 2 : 1)));
    light.power = 0;
    shape.area_light = static_cast<uint32_t>(scene_.area_lights.size());
    scene_.area_lights.push_back(light);
    return {};
}

}  // namespace raypager
