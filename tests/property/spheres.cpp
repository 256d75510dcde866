// The kernels' hits on spheres and points of all sizes, near and far from the origin, against double precision.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "block/point_code.hpp"
#include "support/device_scene.hpp"

namespace raypager {
namespace {

struct Vector {
    double x, y, z;
};
Vector operator+(const Vector& a, const Vector& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
Vector operator-(const Vector& a, const Vector& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
Vector operator*(double s, const Vector& a) { return {s * a.x, s * a.y, s * a.z}; }
double dot(const Vector& a, const Vector& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
double length(const Vector& a) { return std::sqrt(dot(a, a)); }
Vector of(const Float3& v) { return {v.x, v.y, v.z}; }
Float3 rounded(const Vector& v) { return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)}; }

struct Sphere {
    Vector center;
    double radius;
};

// Distance to the nearest hit in front of the origin, INFINITY if there is none. direction is a unit vector.
double exact_hit(const Vector& origin, const Vector& direction, const Sphere& sphere, double radius) {
    const Vector f = origin - sphere.center;
    const double b = -dot(f, direction);
    const Vector across = f + b * direction;
    const double discriminant = radius * radius - dot(across, across);
    if (radius <= 0 || discriminant < 0) return INFINITY;
    const double root = std::sqrt(discriminant);
    if (b - root > 0) return b - root;
    return b + root > 0 ? b + root : INFINITY;
}

// What single precision may be wrong by, as a length: 16 units in the last place of the largest number that goes into the test.
double slack(const Vector& origin, const Sphere& sphere) {
    return 0x1p-20 * (length(origin - sphere.center) + length(sphere.center) + length(origin) + sphere.radius);
}

class SphereHits : public testing::Test {
protected:
    static constexpr uint32_t seed = 71;
    std::mt19937 random_{seed};

    double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
    Vector direction() {
        for (;;) {
            const Vector v = {uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)};
            if (dot(v, v) > 0.01 && dot(v, v) < 1) return (1 / length(v)) * v;
        }
    }

    // Spheres as large as the distance between them within each cluster; clusters differ in size by 2^28. colored: points, of radii
    // that their words hold.
    Scene make_scene(bool colored) {
        std::vector<CloudPoint> points;
        for (int scale = -14; scale <= 14; scale += 2) {
            const double size = std::ldexp(1, scale);
            const Vector middle = uniform(0, 200) * size * direction();
            for (int i = 0; i < 60; i++) {
                const float radius = static_cast<float>(size * (1 + static_cast<double>(random_() % 8) / 8) / 4);
                points.push_back({rounded(middle + uniform(0, 4) * size * direction()), radius});
            }
        }
        for (const CloudPoint& p : points) spheres_.push_back({of(p.position), p.radius});
        Scene scene;
        scene.materials.resize(1);
        scene.camera = *make_camera({0, 0, -5}, {0, 0, 0}, {0, 1, 0}, 40, scene.width, scene.height);
        Shape shape;
        shape.name = "cloud";
        shape.points = std::make_shared<PointsInMemory>("cloud", std::move(points), colored);
        scene.shapes = {shape};
        return scene;
    }

    // At spheres, at their silhouettes, past them, from inside, from the surface, and along axes.
    support::ProbeRay make_ray(size_t i) {
        const Sphere& target = spheres_[random_() % spheres_.size()];
        const Vector from = target.center + std::exp2(uniform(i % 5 == 0 ? -3 : 0, i % 7 == 0 ? 12 : 5)) * target.radius * direction();
        const double aside = i % 3 == 0 ? 1 + uniform(-1e-4, 1e-4) : uniform(0, 1.2);
        Vector way = target.center + aside * target.radius * direction() - from;
        if (i % 11 == 0) way = {0, 0, way.z > 0 ? 1.0 : -1.0};
        const double size = length(way);
        return {rounded(from), INFINITY, rounded((1 / (size > 0 ? size : 1)) * (size > 0 ? way : Vector{1, 0, 0}))};
    }

    void check(const support::ProbeRay& ray, const support::ProbeHit& hit) {
        const Vector origin = of(ray.origin), unnormed = of(ray.direction);
        const double size = length(unnormed);
        const Vector unit = (1 / size) * unnormed;
        const double t = hit.primitive == RP_NONE ? INFINITY : hit.t * size;
        if (hit.primitive != RP_NONE) {
            ASSERT_LT(hit.primitive, spheres_.size());
            const Sphere& sphere = spheres_[hit.primitive];
            hits_++;
            EXPECT_NEAR(length(origin + t * unit - sphere.center), sphere.radius, slack(origin, sphere)) << "not on its sphere";
            EXPECT_NEAR(length(of(hit.position) - sphere.center), sphere.radius, slack(origin, sphere)) << "position";
        }
        EXPECT_EQ(hit.occluded != 0, hit.primitive != RP_NONE);
        for (size_t k = 0; k < spheres_.size(); k++) {
            const double e = slack(origin, spheres_[k]);
            const double beyond = length(origin - spheres_[k].center) - spheres_[k].radius;
            const bool on_surface = std::abs(beyond) <= e;
            // Where it is hit at the latest: where the ray enters a slightly smaller sphere, or leaves a slightly larger one.
            const double surely = exact_hit(origin, unit, spheres_[k], spheres_[k].radius + (beyond > 0 ? -e : e));
            if (on_surface || surely == INFINITY) continue;
            EXPECT_LE(std::min(t, 1e300), surely + 2 * e) << "missed sphere " << k << " of radius " << spheres_[k].radius;
        }
    }

    void run(bool colored) {
        SCOPED_TRACE(testing::Message() << "seed " << seed);
        const support::TemporaryFolder folder;
        BakeOptions options;
        options.block_bytes = 16 << 10;
        auto file = support::bake_and_open(make_scene(colored), options, folder.path(), "spheres");
        ASSERT_TRUE(file.ok()) << file.status().message();
        auto device = support::DeviceScene::create(*file);
        ASSERT_TRUE(device.ok()) << device.status().message();
        std::vector<support::ProbeRay> rays;
        for (size_t i = 0; i < 6000; i++) rays.push_back(make_ray(i));
        auto hits = (*device)->trace(rays);
        ASSERT_TRUE(hits.ok()) << hits.status().message();
        for (size_t i = 0; i < rays.size() && !HasFailure(); i++) {
            SCOPED_TRACE(testing::Message() << "ray " << i);
            check(rays[i], (*hits)[i]);
        }
        EXPECT_GT(hits_, rays.size() / 2);
        EXPECT_LT(hits_, rays.size());
    }

    std::vector<Sphere> spheres_;
    size_t hits_ = 0;
};

TEST_F(SphereHits, of_spheres_are_those_of_double_precision) { run(false); }
TEST_F(SphereHits, of_points_are_those_of_double_precision) { run(true); }

// The kernels' radius of every code is that of the host: rays from above through the middle of one point of each.
TEST(PointRadius, of_every_code_is_the_same_on_the_device) {
    std::vector<CloudPoint> points;
    std::vector<support::ProbeRay> rays;
    float x = 0;
    for (uint32_t code = 0; code <= RP_POINT_LARGEST_CODE; code++) {
        const float radius = point_radius(code);
        x += 2.5f * radius;
        points.push_back({{x, 0, 0}, radius, code});
        rays.push_back({{x, 4 * radius, 0}, INFINITY, {0, -1, 0}});
        x += 2.5f * radius;
    }
    Scene scene;
    scene.materials.resize(1);
    scene.camera = *make_camera({0, 0, -5}, {0, 0, 0}, {0, 1, 0}, 40, scene.width, scene.height);
    Shape shape;
    shape.points = std::make_shared<PointsInMemory>("codes", points, true);
    scene.shapes = {shape};
    const support::TemporaryFolder folder;
    auto file = support::bake_and_open(scene, {}, folder.path(), "codes");
    ASSERT_TRUE(file.ok()) << file.status().message();
    auto device = support::DeviceScene::create(*file);
    ASSERT_TRUE(device.ok()) << device.status().message();
    auto hits = (*device)->trace(rays);
    ASSERT_TRUE(hits.ok()) << hits.status().message();
    for (uint32_t code = 0; code <= RP_POINT_LARGEST_CODE; code++) {
        EXPECT_EQ((*hits)[code].primitive, code);
        EXPECT_NEAR((*hits)[code].t / points[code].radius, 3, 1e-5) << "code " << code;
    }
}

}  // namespace
}  // namespace raypager
