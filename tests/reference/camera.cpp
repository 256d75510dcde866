#include "reference/camera.hpp"

namespace raypager::reference {
namespace {

// About (0, 0, 1), the middle of the square [-1, 1]^2: in its inner half, the diamond, rings of equal |x| + |y| are circles of latitude; the corners
// are folded over the diamond's sides to make the other hemisphere. Areas stay in proportion, so height falls with the square of the ring.
Vec3 from_octahedral_square(double x, double y) {
    double ax = std::abs(x), ay = std::abs(y);
    const bool below = ax + ay > 1;
    if (below) {
        const double folded = 1 - ay;
        ay = 1 - ax;
        ax = folded;
    }
    const double ring = ax + ay, height = 1 - ring * ring, beside = std::sqrt(std::max(0.0, 1 - height * height));
    const double turn = ring > 0 ? ay / ring * pi / 2 : 0;
    return {std::copysign(beside * std::cos(turn), x), std::copysign(beside * std::sin(turn), y), below ? -height : height};
}

double sinc(double x) { return x == 0 ? 1 : std::sin(pi * x) / (pi * x); }

// The function of one coordinate, as it is written in papers.
double filter_value(const PixelFilter& filter, double x, double radius) {
    const double a = filter.first, b = filter.second;
    switch (filter.kind) {
        case PixelFilter::Kind::box:
            return 1;
        case PixelFilter::Kind::triangle:
            return radius - std::abs(x);
        case PixelFilter::Kind::gaussian:
            return std::exp(-a * x * x) - std::exp(-a * radius * radius);
        case PixelFilter::Kind::mitchell: {
            const double t = std::abs(x) / radius * 2, t2 = t * t, t3 = t2 * t;
            return t < 1 ? (12 - 9 * a - 6 * b) * t3 + (-18 + 12 * a + 6 * b) * t2 + 6 - 2 * a
                         : (-a - 6 * b) * t3 + (6 * a + 30 * b) * t2 + (-12 * a - 48 * b) * t + 8 * a + 24 * b;
        }
        case PixelFilter::Kind::sinc:
            return std::abs(x) < 1 ? sinc(x) * sinc(x / a) : 0;
    }
    return 0;
}

// By rejection: none of these functions is anywhere larger than at 0.
double draw(const PixelFilter& filter, double radius, Random& random) {
    const double most = filter_value(filter, 0, radius);
    while (true) {
        const double x = radius * (2 * random.uniform() - 1);
        if (random.uniform() * most < filter_value(filter, x, radius)) return x;
    }
}

}  // namespace

CameraRay camera_ray(const Camera& camera, double u, double v, double lens_x, double lens_y) {
    const Vec3 eye(camera.eye), right(camera.right), up(camera.up), forward(camera.forward);
    if (camera.projection == Projection::equirectangular || camera.projection == Projection::equal_area) {
        const double x = camera.window[0] + u * camera.window[2], y = camera.window[1] + v * camera.window[3];
        if (camera.projection == Projection::equirectangular) {
            const double longitude = 2 * pi * x, latitude = pi * (0.5 - y);
            const Vec3 level = std::cos(longitude) * right + std::sin(longitude) * forward;
            return {eye, normalized(std::cos(latitude) * level + std::sin(latitude) * up)};
        }
        const Vec3 d = from_octahedral_square(2 * x - 1, 2 * y - 1);
        return {eye, normalized(d.x * right + d.y * forward + d.z * up)};
    }
    const Vec3 across = (2 * u - 1) * right + (1 - 2 * v) * up;
    const bool orthographic = camera.projection == Projection::orthographic;
    const Vec3 begin = orthographic ? eye + across : eye, ahead = orthographic ? forward : forward + across;
    if (camera.lens_radius == 0) return {begin, normalized(ahead)};
    const Vec3 in_focus = begin + camera.focal_distance * ahead;
    const Vec3 origin = begin + camera.lens_radius * (lens_x * normalized(right) + lens_y * normalized(up));
    return {origin, normalized(in_focus - origin)};
}

PixelPlace place_in_pixel(const PixelFilter& filter, Random& random) {
    if (filter.is_the_pixel()) {
        const double x = random.uniform();
        return {x, random.uniform()};
    }
    const double x = draw(filter, filter.radius_x, random);
    return {0.5 + x, 0.5 + draw(filter, filter.radius_y, random)};
}

CameraRay camera_ray(const Scene& scene, uint32_t column, uint32_t row, uint32_t width, uint32_t height, Random& random) {
    const PixelPlace place = place_in_pixel(scene.filter, random);
    double x = 0, y = 0;
    if (scene.camera.lens_radius > 0) {
        do {
            x = 2 * random.uniform() - 1;
            y = 2 * random.uniform() - 1;
        } while (x * x + y * y > 1);
    }
    return camera_ray(scene.camera, (column + place.x) / width, (row + place.y) / height, x, y);
}

}  // namespace raypager::reference
