// Coordinates of textures on the device (rp_place_of in kernels/shading/texture.cl) against double precision, and how wide footprints are there.
#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <random>

#include "reference/vector.hpp"
#include "support/texture_probe.hpp"

namespace raypager {
namespace {

using reference::Vec3;

struct MappedPoint {
    float position[3];
    uint32_t map;
    float u, v, density, width;
};

// Coordinates, how far off those of the device may be, and how wide a footprint is there.
struct PlaceInMap {
    Vec3 at, margin;
    double width;
};

double row_sum(const float* row, const Vec3& p) { return row[0] * p.x + row[1] * p.y + row[2] * p.z + row[3]; }
double row_magnitude(const float* row, const Vec3& p) {
    return std::abs(row[0] * p.x) + std::abs(row[1] * p.y) + std::abs(row[2] * p.z) + std::abs(row[3]);
}

// Around spheres and cylinders the footprint is the geometric mean of what it is along both coordinates, on a sphere or cylinder through the point.
PlaceInMap around(const rp_texture_map& map, const Vec3& p, double magnitude, double width) {
    const double across = std::hypot(p.x, p.y), far = length(p), turns = std::atan2(p.y, p.x) / (2 * reference::pi);
    const bool sphere = map.kind == RP_MAP_SPHERE;
    Vec3 st(sphere ? std::acos(p.z / far) / reference::pi : turns + 0.5, sphere ? turns + (turns < 0) : p.z, 0);
    const double off_turn = 1e-7 * (1 + 2 * magnitude / across);
    Vec3 margin(sphere ? 1e-7 * (1 + 4 * magnitude / far) : off_turn, sphere ? off_turn : 2e-7 * magnitude, 0);
    const double along_s = sphere ? width / (reference::pi * far) : width / (2 * reference::pi * across);
    const double along_t = sphere ? width / (2 * reference::pi * across) : width;
    if (map.swapped) std::swap(st.x, st.y), std::swap(margin.x, margin.y);
    const double scale[] = {map.scale[0], map.scale[1]};
    return {{st.x * scale[0] + map.offset[0], st.y * scale[1] + map.offset[1], 0},
            {margin.x * std::abs(scale[0]) + 1e-6, margin.y * std::abs(scale[1]) + 1e-6, 0},
            std::sqrt(along_s * along_t * std::abs(scale[0] * scale[1]))};
}

PlaceInMap place_in(const rp_texture_map* map, const MappedPoint& point) {
    const double u = point.u, v = point.v, width = point.width;
    if (!map) return {{u, v, 0}, Vec3(0.0), width * point.density};
    const float* m = map->m;
    const Vec3 p(point.position), uv(u, v, 0);
    if (map->kind == RP_MAP_UV) {
        const float s[] = {m[0], m[1], 0, m[2]}, t[] = {m[4], m[5], 0, m[6]};
        return {{row_sum(s, uv), row_sum(t, uv), 0},
                {2e-7 * row_magnitude(s, uv), 2e-7 * row_magnitude(t, uv), 0},
                width * point.density * std::sqrt(std::abs(double{m[0]} * m[5] - double{m[1]} * m[4]))};
    }
    const Vec3 at(row_sum(m, p), row_sum(m + 4, p), row_sum(m + 8, p));
    const Vec3 magnitude(row_magnitude(m, p), row_magnitude(m + 4, p), row_magnitude(m + 8, p));
    double longest = 0;
    for (int row = 0; row < 3; row++) longest = std::max(longest, length(Vec3(m[4 * row], m[4 * row + 1], m[4 * row + 2])));
    if (map->kind == RP_MAP_POINT) return {at, 3e-7 * magnitude, width * longest};
    return around(*map, at, 3 * max_component(magnitude), width * longest);
}

// Of all kinds, swapped or not; those of points are similarities, so that footprints have one width.
std::vector<rp_texture_map> random_maps(std::mt19937& random) {
    std::uniform_real_distribution<float> any(-3, 3);
    std::vector<rp_texture_map> maps;
    for (uint32_t i = 0; i < 60; i++) {
        rp_texture_map map = {i % 4, i / 4 % 2, {}, {}, {any(random), any(random)}, {any(random), any(random)}};
        for (float& x : map.m) x = any(random);
        const double size = std::exp2(any(random));
        const reference::Frame frame(reference::normalized(Vec3(any(random), any(random), any(random))));
        const Vec3 rows[] = {size * frame.x, size * frame.y, size * frame.z};
        for (int k = 0; map.kind != RP_MAP_UV && k < 12; k++)
            if (k % 4 < 3) map.m[k] = static_cast<float>(rows[k / 4][k % 4]);
        maps.push_back(map);
    }
    return maps;
}

TEST(TextureMapsOnDevice, CoordinatesAndFootprintsAreAsInDoublePrecision) {
    std::mt19937 random(51);
    std::uniform_real_distribution<float> any(-4, 4);
    Scene scene;
    scene.texture_maps = random_maps(random);
    support::TextureProbe probe(scene);
    std::vector<MappedPoint> points;
    for (uint32_t i = 0; i < 20000; i++) {
        const auto map = static_cast<uint32_t>(i % (scene.texture_maps.size() + 1));
        points.push_back({{any(random), any(random), any(random)},
                          map == scene.texture_maps.size() ? RP_NONE : map,
                          any(random),
                          any(random),
                          std::exp2(any(random)),
                          std::exp2(any(random))});
    }
    const auto found = probe.run<std::array<float, 4>>("rp_probe_maps", points, points.size());
    double narrowest = 1, widest = 1;
    for (size_t i = 0; i < points.size(); i++) {
        const rp_texture_map* map = points[i].map == RP_NONE ? nullptr : &scene.texture_maps[points[i].map];
        const PlaceInMap expected = place_in(map, points[i]);
        const double whole = map && map->kind >= RP_MAP_SPHERE ? std::abs(map->scale[map->kind == RP_MAP_SPHERE ? !map->swapped : map->swapped]) : 0;
        for (int k = 0; k < 3; k++) {
            double off = std::abs(found[i][static_cast<size_t>(k)] - expected.at[k]);
            // Next to where a turn ends, floats may begin the next one.
            if (std::abs(off - whole) <= expected.margin[k]) off = 0;
            EXPECT_LE(off, expected.margin[k]) << i << ", map " << points[i].map << ", kind " << (map ? map->kind : 9) << ": " << k;
        }
        const double ratio = found[i][3] / expected.width;
        if (map && map->kind == RP_MAP_SPHERE) {
            const Vec3 p(row_sum(map->m, Vec3(points[i].position)), row_sum(map->m + 4, Vec3(points[i].position)),
                         row_sum(map->m + 8, Vec3(points[i].position)));
            if (std::abs(p.z) > std::hypot(p.x, p.y)) continue;  // towards the poles they are narrower and narrower
            narrowest = std::min(narrowest, ratio);
            widest = std::max(widest, ratio);
        } else {
            EXPECT_NEAR(ratio, 1, 1e-5) << i << ", kind " << (map ? map->kind : 9);
        }
    }
    std::printf("on spheres footprints are %.2f to %.2f times as wide as they should be\n", narrowest, widest);
    EXPECT_GT(narrowest, 0.95);
    EXPECT_LT(widest, 1.25);
}

// Where angles are of nothing.
TEST(TextureMapsOnDevice, CentresAndAxesHaveSomeCoordinates) {
    Scene scene;
    for (const uint32_t kind : {RP_MAP_SPHERE, RP_MAP_CYLINDER})
        scene.texture_maps.push_back({kind, 0, {}, {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}, {1, 1}, {0, 0}});
    support::TextureProbe probe(scene);
    std::vector<MappedPoint> points;
    for (const uint32_t map : {0u, 1u})
        for (const float z : {0.0f, -0.0f, 2.0f, -2.0f})
            for (const float x : {0.0f, -0.0f}) points.push_back({{x, 0, z}, map, 0, 0, 1, 1});
    const auto found = probe.run<std::array<float, 4>>("rp_probe_maps", points, points.size());
    for (size_t i = 0; i < points.size(); i++) {
        const float z = points[i].position[2];
        for (const float x : found[i]) EXPECT_TRUE(std::isfinite(x)) << i;
        if (points[i].map == 0 && z != 0) {
            EXPECT_EQ(found[i][0], z > 0 ? 0.0f : 1.0f);
        }
        if (points[i].map == 1) {
            EXPECT_EQ(found[i][1], z);
        }
    }
}

}  // namespace
}  // namespace raypager
