#include "raypager/sky.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

#include "base/check.hpp"
#include "base/parallel.hpp"
#include "scene/light_images.hpp"
#include "scene/vector.hpp"

namespace raypager {
namespace {

using std::numbers::pi;

// A globe is looked at in so many places a pixel and axis: its pixels shrink towards the poles.
constexpr uint32_t places_per_pixel = 3;

Float3 pixel(const Image& image, int64_t x, int64_t y) {
    const float* p = &image.values[(static_cast<size_t>(y) * image.width + static_cast<size_t>(x)) * image.channels];
    return image.channels >= 3 ? Float3{p[0], p[1], p[2]} : Float3{p[0], p[0], p[0]};
}

Float3 mixed(const Float3& a, const Float3& b, double share_of_b) {
    const auto t = static_cast<float>(share_of_b);
    return {a.x * (1 - t) + b.x * t, a.y * (1 - t) + b.y * t, a.z * (1 - t) + b.z * t};
}

// at: wraps pixels beyond the edges.
template <class At>
Float3 interpolated(const Image& image, const std::array<double, 2>& place, const At& at) {
    const double x = place[0] * image.width - 0.5, y = place[1] * image.height - 0.5, left = std::floor(x), top = std::floor(y);
    const auto i = static_cast<int64_t>(left), j = static_cast<int64_t>(top);
    return mixed(mixed(at(i, j), at(i + 1, j), x - left), mixed(at(i, j + 1), at(i + 1, j + 1), x - left), y - top);
}

Float3 sky_pixel(const Image& image, int64_t x, int64_t y) {
    const int64_t last = int64_t{image.width} - 1;
    if (x < 0 || x > last) x = x < 0 ? 0 : last, y = last - y;
    if (y < 0 || y > last) y = y < 0 ? 0 : last, x = last - x;
    return pixel(image, x, y);
}

Float3 globe_color(const Image& globe, const std::array<double, 2>& place) {
    return interpolated(globe, place, [&](int64_t x, int64_t y) {
        const int64_t width = globe.width;
        return pixel(globe, (x + width) % width, std::clamp<int64_t>(y, 0, int64_t{globe.height} - 1));
    });
}

}  // namespace

std::array<double, 2> sky_place(const std::array<double, 3>& direction) {
    const auto [x, y, z] = direction;
    const double length = std::hypot(x, y, z), across = std::hypot(x, y);
    const double r = across / std::sqrt(length * (length + std::abs(z)));
    const double quarter = across > 0 ? std::atan2(std::abs(y), std::abs(x)) * 2 / pi : 0;
    double u = r * (1 - quarter), v = r * quarter;
    if (z < 0) std::tie(u, v) = std::pair(1 - v, 1 - u);
    return {(std::copysign(u, x) + 1) / 2, (std::copysign(v, y) + 1) / 2};
}

std::array<double, 3> sky_direction(double u, double v) {
    const double x = 2 * u - 1, y = 2 * v - 1, to_horizon = 1 - (std::abs(x) + std::abs(y)), r = 1 - std::abs(to_horizon);
    const double angle = r > 0 ? ((std::abs(y) - std::abs(x)) / r + 1) * pi / 4 : pi / 4, across = r * std::sqrt(2 - r * r);
    return {std::copysign(std::cos(angle) * across, x), std::copysign(std::sin(angle) * across, y), std::copysign(1 - r * r, to_horizon)};
}

std::array<double, 2> globe_place(const std::array<double, 3>& direction) {
    const auto [x, y, z] = direction;
    const double turns = std::atan2(y, x) / (2 * pi);
    return {turns < 0 ? turns + 1 : turns, std::atan2(std::hypot(x, y), z) / pi};
}

Image sky_of_globe(const Image& globe) {
    // At the horizon a pixel of the sky is then three quarters of one of the globe, where that is twice as wide as it is high.
    const auto side = static_cast<uint32_t>(std::clamp(0.75 * std::max<double>(globe.width, 2.0 * globe.height), 1.0, double{max_sky_size}));
    Image sky{side, side, 3, std::vector<float>(size_t{3} * side * side)};
    parallel_for(side, 8, [&](size_t begin, size_t end) {
        for (size_t y = begin; y < end; y++)
            for (uint32_t x = 0; x < side; x++) {
                double sum[3] = {};
                for (uint32_t j = 0; j < places_per_pixel; j++)
                    for (uint32_t i = 0; i < places_per_pixel; i++) {
                        const double u = (x + (i + 0.5) / places_per_pixel) / side,
                                     v = (static_cast<double>(y) + (j + 0.5) / places_per_pixel) / side;
                        const Float3 c = globe_color(globe, globe_place(sky_direction(u, v)));
                        sum[0] += c.x, sum[1] += c.y, sum[2] += c.z;
                    }
                for (size_t k = 0; k < 3; k++)
                    sky.values[3 * (y * side + x) + k] = static_cast<float>(sum[k] / (places_per_pixel * places_per_pixel));
            }
    });
    return sky;
}

Float3 sky_color(const Image& image, const std::array<double, 3>& direction) {
    return interpolated(image, sky_place(direction), [&](int64_t x, int64_t y) { return sky_pixel(image, x, y); });
}

Float3 texel_color(const rp_texel& texel) {
    const float scale = std::bit_cast<float>(texel.blue_exponent >> 16 << 23);
    return {static_cast<float>(texel.red_green & 0xffffu) * scale, static_cast<float>(texel.red_green >> 16) * scale,
            static_cast<float>(texel.blue_exponent & 0xffffu) * scale};
}

rp_texel texel_of(const Float3& color) {
    const float largest = std::max({color.x, color.y, color.z});
    if (!(largest > 0)) return {0, 1u << 16};
    constexpr int bias = 127, bits = 16;
    int exponent = std::max(1, std::ilogb(largest) - (bits - 1) + bias);
    // Rounding up may take one bit more.
    if (std::nearbyint(std::ldexp(largest, bias - exponent)) > 65535) exponent++;
    const auto code = [&](float x) {
        return static_cast<uint32_t>(std::clamp(std::nearbyint(std::ldexp(static_cast<double>(x), bias - exponent)), 0.0, 65535.0));
    };
    exponent = std::min<int>(exponent, RP_TEXEL_MAX_EXPONENT);
    return {code(color.x) | code(color.y) << 16, code(color.z) | static_cast<uint32_t>(exponent) << 16};
}

Result<std::shared_ptr<const LightImage>> light_image_of(const Image& image) {
    const uint64_t texels = uint64_t{image.width} * image.height;
    if (texels == 0 || texels > max_light_texels || (image.channels != 1 && image.channels != 3) || image.values.size() != texels * image.channels)
        return Status::failed(fmt::format("the image of a light has one channel or three, and 1 to {} pixels, not {} x {}", max_light_texels,
                                          image.width, image.height));
    if (std::ranges::any_of(image.values, [](float v) { return !(v >= 0) || !std::isfinite(v); }))
        return Status::failed("the pixels of a light's image must be finite and 0 or more");
    auto result = std::make_shared<LightImage>(LightImage{image.width, image.height, {}});
    result->texels.reserve(texels);
    for (uint32_t y = 0; y < image.height; y++)
        for (uint32_t x = 0; x < image.width; x++) result->texels.push_back(texel_of(pixel(image, x, y)));
    return std::shared_ptr<const LightImage>(std::move(result));
}

Float3 mean_color(const LightImage& image) {
    double sum[3] = {};
    for (const rp_texel& texel : image.texels) {
        const Float3 c = texel_color(texel);
        sum[0] += c.x, sum[1] += c.y, sum[2] += c.z;
    }
    const double share = 1 / static_cast<double>(image.texels.size());
    return {static_cast<float>(sum[0] * share), static_cast<float>(sum[1] * share), static_cast<float>(sum[2] * share)};
}

Status set_sky(Scene& scene, const Image& image, const std::array<Float3, 3>& axes) {
    auto sky = light_image_of(image);
    if (!sky) return sky.status();
    rp_light light = {};
    light.kind = RP_LIGHT_INFINITE;
    const auto store = [](const Float3& from, float(&to)[3]) { to[0] = from.x, to[1] = from.y, to[2] = from.z; };
    store(axes[0], light.p);
    store(axes[1], light.e1);
    store(axes[2], light.e2);
    store(mean_color(**sky), light.radiance);
    std::erase_if(scene.lights, [](const rp_light& other) { return other.kind == RP_LIGHT_INFINITE; });
    scene.light_images.push_back(*sky);
    light.flags = static_cast<rp_u32>(scene.light_images.size()) << RP_LIGHT_IMAGE_SHIFT;
    scene.lights.push_back(light);
    return check_light_images(scene.light_images, scene.lights);
}

std::optional<uint32_t> image_of(const rp_light& light) {
    const uint32_t number = light.flags >> RP_LIGHT_IMAGE_SHIFT;
    return number > 0 ? std::optional(number - 1) : std::nullopt;
}

std::optional<uint32_t> sky_image(std::span<const rp_light> lights) {
    const auto sky = std::ranges::find(lights, rp_u32{RP_LIGHT_INFINITE}, &rp_light::kind);
    return sky != lights.end() ? image_of(*sky) : std::nullopt;
}

namespace {

bool are_axes(std::initializer_list<Vector> axes) {
    for (const Vector& a : axes)
        for (const Vector& b : axes)
            if (!(std::abs(dot(a, b) - (&a == &b ? 1 : 0)) < 1e-4)) return false;
    return true;
}

Status check_lamp(const rp_light& light, const LightImage* image) {
    const auto vector = [](const float(&v)[3]) { return Vector{v[0], v[1], v[2]}; };
    const Vector p = vector(light.p), e1 = vector(light.e1), e2 = vector(light.e2);
    const bool square = image && image->width == image->height;
    switch (light.kind) {
        case RP_LIGHT_INFINITE:
            if (image && !(square && are_axes({p, e1, e2}))) return Status::failed("a sky is not square, or its axes are not at right angles");
            return {};
        case RP_LIGHT_POINT:
            if (image && !(square && are_axes({e1, e2}))) return Status::failed("a lamp's image is not square, or its axes are not at right angles");
            return {};
        case RP_LIGHT_SPOT:
            if (image || !are_axes({e1}) || !(e2[0] <= e2[1])) return Status::failed("a spot light has an image, no axis or no cone");
            return {};
        case RP_LIGHT_PROJECTION:
            if (!image || !(length(cross(e1, e2)) > 0)) return Status::failed("a projection has no image or no direction");
            return {};
        default:
            return image ? Status::failed("a light of this kind cannot have an image") : Status();
    }
}

}  // namespace

Status check_light_images(const LightImages& images, std::span<const rp_light> lights, bool sky_in_pages) {
    for (const rp_light& light : lights) {
        const auto number = image_of(light);
        if (number && *number >= images.size()) return Status::failed("a light's image does not exist");
        RAYPAGER_TRY(check_lamp(light, number ? images[*number].get() : nullptr));
        if (sky_in_pages && light.kind != RP_LIGHT_INFINITE && number && number == sky_image(lights))
            return Status::failed("a lamp has the image of the sky, which is in pages");
    }
    const std::optional<uint32_t> in_pages = sky_in_pages ? sky_image(lights) : std::nullopt;
    if (sky_in_pages && !in_pages) return Status::failed("the sky that is in pages does not exist");
    uint64_t all = 0;
    for (size_t i = 0; i < images.size(); i++) {
        const LightImage& image = *images[i];
        const uint64_t texels = uint64_t{image.width} * image.height;
        all += texels;
        if (texels == 0 || image.width > max_sky_size || image.height > max_sky_size || all > max_light_texels ||
            image.texels.size() != (i == in_pages ? 0 : texels))
            return Status::failed(
                fmt::format("images are empty or larger than {0} x {0}, or have more than {1} pixels in all", max_sky_size, max_light_texels));
        for (const rp_texel& texel : image.texels)
            if (const uint32_t exponent = texel.blue_exponent >> 16; exponent < 1 || exponent > RP_TEXEL_MAX_EXPONENT)
                return Status::failed("a colour is not finite");
    }
    return {};
}

}  // namespace raypager
