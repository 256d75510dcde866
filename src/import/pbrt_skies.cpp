// The images of lights: how they are read, and what several skies make together.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "import/pbrt_reader.hpp"
#include "import/text.hpp"
#include "raypager/sky.hpp"
#include "scene/vector.hpp"

namespace raypager {
namespace {

// What a sky sheds on a surface that faces up, as pbrt-v4 adds it up for "illuminance": it takes half a pixel's solid angle.
double illuminance_of(const Image& sky) {
    double sum = 0;
    for (uint32_t y = 0; y < sky.height; y++)
        for (uint32_t x = 0; x < sky.width; x++) {
            const auto direction = sky_direction((x + 0.5) / sky.width, (y + 0.5) / sky.height);
            if (direction[2] <= 0) continue;
            const float* p = &sky.values[(size_t{y} * sky.width + x) * sky.channels];
            sum += (sky.channels == 3 ? 0.2126 * p[0] + 0.7152 * p[1] + 0.0722 * p[2] : p[0]) * direction[2];
        }
    return sum * 2 * std::numbers::pi / (double(sky.width) * sky.height);
}

}  // namespace

// Pixels that are not finite or negative do not shine.
Status PbrtReader::read_light_image(const Directive& directive, const PbrtParameter& file, Image& image) {
    std::filesystem::path path;
    bool exists = false;
    if (file.strings.size() != 1) return parameter_error(file, "expected the name of one image");
    if (const Status found = find_file(file.strings[0], path, exists); !found.ok()) return parameter_error(file, found.message());
    auto read = read_image(path);
    if (!read) return read.status().at(directive.location.with_line());
    image = std::move(*read);
    if (listed_files_.insert(path.string()).second) scene_.files.push_back(path.string());
    uint64_t bad = 0;
    for (float& value : image.values)
        if (!(value >= 0) || !std::isfinite(value)) {
            value = 0;
            bad++;
        }
    if (bad > 0)
        warn(directive.location, fmt::format("{} values of \"{}\" are negative or not finite; they are taken as 0", bad, clipped(file.strings[0])));
    return {};
}

// Into the mapping of skies. Images are square in it already; those of version 3 are the maps of globes.
Status PbrtReader::bring_into_sky(const Directive& directive, const PbrtParameter& file, Image& image) {
    const bool globe = file.name == "mapname";
    if (!globe && image.width == image.height) {
        if (image.width > max_sky_size)
            return Status::failed(fmt::format("{}: \"{}\" has {} pixels a side; at most {} are accepted", directive.location.with_line(),
                                              clipped(file.strings[0]), image.width, max_sky_size));
        return {};
    }
    if (!globe && image.width != 2 * uint64_t{image.height})
        return Status::failed(
            fmt::format("{}: \"{}\" has {} x {} pixels; the image of all directions is square, in the equal-area mapping of pbrt-v4, "
                        "or twice as wide as high, the map of a globe",
                        directive.location.with_line(), clipped(file.strings[0]), image.width, image.height));
    if (!globe)
        warn(directive.location, fmt::format("\"{}\" is twice as wide as high; it is taken as the map of a globe, z upwards, which pbrt-v4 refuses",
                                             clipped(file.strings[0])));
    image = sky_of_globe(image);
    return {};
}

// The axes of a light's space in the world.
Status PbrtReader::light_axes(const Directive& directive, std::array<Float3, 3>& axes) {
    Vector v[3] = {state_.transform.vector(1, 0, 0), state_.transform.vector(0, 1, 0), state_.transform.vector(0, 0, 1)};
    const double shortest = std::min({length(v[0]), length(v[1]), length(v[2])}), longest = std::max({length(v[0]), length(v[1]), length(v[2])});
    const double volume = dot(cross(v[0], v[1]), v[2]);
    if (!(std::abs(volume) > 0) || !std::isfinite(volume)) return error(directive, "its transform cannot be inverted");
    const double skew = std::max({std::abs(dot(v[0], v[1])), std::abs(dot(v[1], v[2])), std::abs(dot(v[2], v[0]))});
    if (longest > 1.0001 * shortest || skew > 1e-4 * longest * longest)
        warn(directive.location, "the image of a light is rotated and mirrored alone; that its transform stretches or skews it is ignored");
    // z is kept, and what the others leave of right angles is taken away.
    v[2] = unit(v[2]);
    v[0] = unit(v[0] - dot(v[0], v[2]) * v[2]);
    v[1] = (volume < 0 ? -1.0 : 1.0) * cross(v[2], v[0]);
    for (size_t i = 0; i < 3; i++) axes[i] = float3(v[i]);
    return {};
}

Status PbrtReader::add_light_image(const Directive& directive, const Image& image, rp_light& light) {
    auto packed = light_image_of(image);
    if (!packed) return packed.status().at(directive.location.with_line());
    scene_.light_images.push_back(*packed);
    light.flags |= static_cast<rp_u32>(scene_.light_images.size()) << RP_LIGHT_IMAGE_SHIFT;
    return {};
}

Status PbrtReader::image_sky(const Directive& directive, const PbrtParameters& parameters, const PbrtParameter& file) {
    PbrtSky sky;
    Float3 factor;
    RAYPAGER_TRY(light_color(parameters, "L", factor, -1));
    const double illuminance = parameters.number("illuminance", 0);
    RAYPAGER_TRY(parameters.status());
    if (file.name == "filename" && parameters.find("L"))
        warn(directive.location, "a sky has both an image and \"L\", which pbrt-v4 refuses; they are multiplied");
    RAYPAGER_TRY(read_light_image(directive, file, sky.image));
    RAYPAGER_TRY(bring_into_sky(directive, file, sky.image));
    RAYPAGER_TRY(light_axes(directive, sky.axes));
    if (illuminance > 0) {
        const double of_image = illuminance_of(sky.image);
        if (!(of_image > 0)) return error(directive, "its image is black above the horizon: no scale gives that illuminance");
        const auto f = static_cast<float>(illuminance / of_image);
        factor = {factor.x * f, factor.y * f, factor.z * f};
    }
    if (sky.image.channels == 1) {
        Image rgb{sky.image.width, sky.image.height, 3, {}};
        rgb.values.reserve(3 * sky.image.values.size());
        for (const float v : sky.image.values) rgb.values.insert(rgb.values.end(), 3, v);
        sky.image = std::move(rgb);
    }
    const float factors[3] = {factor.x, factor.y, factor.z};
    for (size_t i = 0; i < sky.image.values.size(); i++) {
        sky.image.values[i] *= factors[i % 3];
        if (!std::isfinite(sky.image.values[i])) return error(directive, "its image is too bright to compute with");
    }
    if (!sky_) {
        sky_ = std::move(sky);
        return {};
    }
    warn(directive.location, "several images of skies are added up, in the pixels of the largest one");
    if (sky.image.width > sky_->image.width) std::swap(sky, *sky_);
    const uint32_t size = sky_->image.width;
    for (uint32_t y = 0; y < size; y++)
        for (uint32_t x = 0; x < size; x++) {
            const Vector d = sky_direction((x + 0.5) / size, (y + 0.5) / size);
            const Vector world = d[0] * vector(sky_->axes[0]) + d[1] * vector(sky_->axes[1]) + d[2] * vector(sky_->axes[2]);
            const Float3 c =
                sky_color(sky.image, {dot(world, vector(sky.axes[0])), dot(world, vector(sky.axes[1])), dot(world, vector(sky.axes[2]))});
            float* p = &sky_->image.values[3 * (size_t{y} * size + x)];
            p[0] += c.x, p[1] += c.y, p[2] += c.z;
        }
    return {};
}

// Once all lights are known: light that is the same everywhere shines through the image, too.
Status PbrtReader::finish_sky() {
    if (!sky_) return {};
    for (const rp_light& light : scene_.lights)
        for (size_t i = 0; light.kind == RP_LIGHT_INFINITE && i < sky_->image.values.size(); i++) sky_->image.values[i] += light.radiance[i % 3];
    return set_sky(scene_, sky_->image, sky_->axes);
}

}  // namespace raypager
