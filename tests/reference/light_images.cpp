#include "reference/light_images.hpp"

#include <bit>
#include <utility>

namespace raypager::reference {
namespace {

Vec3 texel(const LightImage& image, int x, int y) {
    const rp_texel& t = image.texels[static_cast<size_t>(y) * image.width + static_cast<size_t>(x)];
    const double scale = std::ldexp(1.0, static_cast<int>(t.blue_exponent >> 16) - 127);
    return Vec3(t.red_green & 0xffff, t.red_green >> 16, t.blue_exponent & 0xffff) * scale;
}

// The sphere is an octahedron that was cut open at -z and flattened: beyond an edge lies what is on its other half.
Vec3 folded_texel(const LightImage& image, int x, int y) {
    const int n = static_cast<int>(image.width);
    if (x == -1 || x == n) return folded_texel(image, x == -1 ? 0 : n - 1, n - 1 - y);
    if (y == -1 || y == n) return folded_texel(image, n - 1 - x, y == -1 ? 0 : n - 1);
    return texel(image, x, y);
}

}  // namespace

Vec3 color_in_direction(const LightImage& image, const Vec3& d) {
    // In its quadrant the azimuth runs evenly along the diagonals; how far out these lie is such that areas agree.
    const double azimuth = std::atan2(std::abs(d.y), std::abs(d.x)) / (pi / 2), from_pole = std::sqrt(std::max(0.0, 1 - std::abs(d.z)));
    double u = from_pole * (1 - azimuth), v = from_pole * azimuth;
    if (d.z < 0) {
        const double upper_u = u;
        u = 1 - v;
        v = 1 - upper_u;
    }
    const double n = image.width, x = (d.x < 0 ? 1 - u : 1 + u) / 2 * n - 0.5, y = (d.y < 0 ? 1 - v : 1 + v) / 2 * n - 0.5;
    const double left = std::floor(x), top = std::floor(y), s = x - left, t = y - top;
    const int i = static_cast<int>(left), j = static_cast<int>(top);
    return (folded_texel(image, i, j) * (1 - s) + folded_texel(image, i + 1, j) * s) * (1 - t) +
           (folded_texel(image, i, j + 1) * (1 - s) + folded_texel(image, i + 1, j + 1) * s) * t;
}

Vec3 color_at(const LightImage& image, double x, double y) {
    if (!(x >= 0 && x <= 1 && y >= 0 && y <= 1)) return {};
    const double column = std::clamp(x * image.width - 0.5, 0.0, image.width - 1.0),
                 row = std::clamp(y * image.height - 0.5, 0.0, image.height - 1.0);
    const int i = static_cast<int>(column), j = static_cast<int>(row);
    const int right = std::min(i + 1, static_cast<int>(image.width) - 1), below = std::min(j + 1, static_cast<int>(image.height) - 1);
    const double s = column - i, t = row - j;
    return (texel(image, i, j) * (1 - s) + texel(image, right, j) * s) * (1 - t) +
           (texel(image, i, below) * (1 - s) + texel(image, right, below) * s) * t;
}

Vec3 lamp_intensity(const rp_light& light, const LightImages& images, const Vec3& direction) {
    const Vec3 intensity(light.radiance), e1(light.e1), e2(light.e2);
    const double handedness = light.flags & RP_LIGHT_MIRRORED ? -1 : 1;
    const uint32_t number = light.flags >> RP_LIGHT_IMAGE_SHIFT;
    if (light.kind == RP_LIGHT_SPOT) {
        const double cosine = dot(e1, direction), t = std::clamp((cosine - light.e2[0]) / (double{light.e2[1]} - light.e2[0]), 0.0, 1.0);
        return intensity * (light.e2[2] != 0 ? std::pow(t, 4) : t * t * (3 - 2 * t));
    }
    if (number == 0) return intensity;
    const LightImage& image = *images[number - 1];
    if (light.kind == RP_LIGHT_POINT)
        return intensity * color_in_direction(image, {dot(e1, direction), dot(e2, direction), handedness * dot(cross(e1, e2), direction)});
    const double depth = handedness * dot(normalized(cross(e1, e2)), direction);
    if (depth <= 0) return {};
    const Vec3 on_plane = direction / depth;
    return intensity * color_at(image, (1 + dot(on_plane, e1) / dot(e1, e1)) / 2, (1 - dot(on_plane, e2) / dot(e2, e2)) / 2);
}

}  // namespace raypager::reference
