// Rays into instances (kernels/common/instance.cl), from near and from far away: how far they pass from where they should, and that what they meet of
// an object they meet of its bounds in the world.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "device/device.hpp"
#include "property/passage.hpp"
#include "support/probe_kernels.hpp"
#include "world/instance_record.hpp"

namespace raypager {
namespace {

using Point = std::array<double, 3>;

struct ProbeFloat4 {
    float x, y, z, w;
};

double length_of(const Point& p) { return std::sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]); }

class PlacedRays {
public:
    PlacedRays(uint64_t seed, double world, double distance) : random_(seed), world_(world), distance_(distance) {}

    // Turned and stretched as may be; every third mirrored, every other along the axes.
    Transform placement(uint32_t i) {
        Transform t = Transform::translate(between(-world_, world_), between(-world_, world_), between(-world_, world_));
        if (i % 2 == 0) t = t * Transform::rotate(between(0, 360), between(-1, 1), between(-1, 1), 0.3);
        const double size = std::exp(between(-1.2, 1.2)), mirror = i % 3 == 0 ? -1 : 1;
        return t * Transform::scale(mirror * size * std::exp(between(-0.5, 0.5)), size, size * std::exp(between(-0.5, 0.5)));
    }
    Box object_box() {
        Box box;
        for (int a = 0; a < 3; a++) {
            const double middle = between(-20, 20), half = between(0.2, 1);
            box.lower[a] = static_cast<float>(middle - half);
            box.upper[a] = static_cast<float>(middle + half);
        }
        return box;
    }
    // A small part of a box, often at its surface.
    Box part_of(const Box& box) {
        Box part;
        for (int a = 0; a < 3; a++) {
            const double share = between(0, 1) < 0.6 ? (between(0, 1) < 0.5 ? 0 : 1) : between(0, 1), extent = double{box.upper[a]} - box.lower[a];
            part.lower[a] = std::max(box.lower[a], static_cast<float>(box.lower[a] + extent * (share - 5e-5)));
            part.upper[a] = std::min(box.upper[a], static_cast<float>(box.lower[a] + extent * (share + 5e-5)));
        }
        return part;
    }
    // From so far away towards a place; every fourth nearly along an axis.
    void aim(uint32_t i, const Point& place, float* origin, float* direction) {
        Point away = {between(-1, 1), between(-1, 1), between(-1, 1)};
        if (i % 4 == 1)
            for (size_t a = 0; a < 3; a++) away[a] = a == i / 4 % 3 ? 1 : between(-1e-4, 1e-4);
        const double scale = distance_ / std::max(length_of(away), 1e-3);
        Point to = {};
        for (size_t a = 0; a < 3; a++) {
            origin[a] = static_cast<float>(place[a] - scale * away[a]);
            to[a] = place[a] - origin[a];
        }
        const double length = length_of(to);
        for (size_t a = 0; a < 3; a++) direction[a] = static_cast<float>(length > 0 ? to[a] / length : a == 0);
    }

private:
    double between(double a, double b) { return std::uniform_real_distribution<double>(a, b)(random_); }
    std::mt19937_64 random_;
    const double world_, distance_;
};

// How far the line of a ray passes from a place on the exact one, the nearest to the middle of the box.
double lateral_error(const Transform& to_object, const float* origin, const float* direction, const ProbeFloat4* placed, const Point& middle) {
    const Point o = to_object.point(origin[0], origin[1], origin[2]), d = to_object.vector(direction[0], direction[1], direction[2]);
    const auto nearest = [](const Point& o, const Point& d, const Point& p) {
        double along = 0, squared = 0;
        for (size_t a = 0; a < 3; a++) {
            along += (p[a] - o[a]) * d[a];
            squared += d[a] * d[a];
        }
        return Point{o[0] + along / squared * d[0], o[1] + along / squared * d[1], o[2] + along / squared * d[2]};
    };
    const Point there = nearest(o, d, middle);
    const Point found = nearest({placed[0].x, placed[0].y, placed[0].z}, {placed[1].x, placed[1].y, placed[1].z}, there);
    return length_of({found[0] - there[0], found[1] - there[1], found[2] - there[2]});
}

struct PlacedCase {
    double world, distance;  // coordinates of instances at most; how far rays come from
    double largest_error;    // of 999 in 1000, in extents of the object
};

class InstanceRays : public testing::TestWithParam<PlacedCase> {};

TEST_P(InstanceRays, meet_what_is_there_and_its_bounds) {
    const auto& [world, distance, largest_error] = GetParam();
    constexpr uint64_t seed = 99;
    constexpr uint32_t count = 100000;
    PlacedRays rays(seed, world, distance);
    std::vector<rp_instance> instances;
    std::vector<ProbeFloat4> bases, probes;
    std::vector<Box> boxes, parts;
    for (uint32_t i = 0; i < count; i++) {
        boxes.push_back(rays.object_box());
        parts.push_back(rays.part_of(boxes.back()));
        const auto instance = make_instance(rays.placement(i), boxes.back());
        ASSERT_TRUE(instance.has_value());
        instances.push_back(*instance);
        const Box &box = boxes.back(), &part = parts.back();
        const auto middle = [](const Box& b, size_t a) { return (double{b.lower[a]} + b.upper[a]) / 2; };
        const Point place = placement_of(*instance, box).point(middle(part, 0), middle(part, 1), middle(part, 2));
        float origin[3], direction[3];
        rays.aim(i, place, origin, direction);
        bases.push_back({static_cast<float>(middle(box, 0)), static_cast<float>(middle(box, 1)), static_cast<float>(middle(box, 2)), 0});
        probes.push_back({origin[0], origin[1], origin[2], 0});
        probes.push_back({direction[0], direction[1], direction[2], 0});
    }
    auto device = Device::open("", 0);
    ASSERT_TRUE(device.ok()) << device.status().message();
    auto kernel = support::probe_kernel(**device, "common/instance_probe", "rp_probe_instances", "");
    ASSERT_TRUE(kernel.ok()) << kernel.status().message();
    const auto instance_buffer = (*device)->upload(bytes_of(instances), "instances"), base_buffer = (*device)->upload(bytes_of(bases), "bases");
    const auto ray_buffer = (*device)->upload(bytes_of(probes), "rays"), results = (*device)->allocate(count * 32, "results");
    ASSERT_TRUE(instance_buffer.ok() && base_buffer.ok() && ray_buffer.ok() && results.ok());
    ASSERT_TRUE(kernel->set(*instance_buffer, *base_buffer, *ray_buffer, count, *results).ok());
    ASSERT_TRUE((*device)->kernels().launch(*kernel, count, (*device)->group_size()).ok());
    std::vector<ProbeFloat4> placed(2 * count);
    ASSERT_TRUE((*device)->kernels().read_now(*results, 0, std::as_writable_bytes(std::span(placed))).ok());
    std::vector<double> errors;
    uint32_t met = 0;
    for (uint32_t i = 0; i < count; i++) {
        const float *origin = &probes[2 * i].x, *direction = &probes[2 * i + 1].x;
        const auto to_object = placement_of(instances[i], boxes[i]).inverse();
        ASSERT_TRUE(to_object.has_value());
        double extent = 0;
        for (size_t a = 0; a < 3; a++) extent = std::max(extent, double{boxes[i].upper[a]} - boxes[i].lower[a]);
        errors.push_back(lateral_error(*to_object, origin, direction, &placed[2 * i], {bases[i].x, bases[i].y, bases[i].z}) / extent);
        const Passage inside = exact_passage(&placed[2 * i].x, &placed[2 * i + 1].x, parts[i]);
        if (inside.entry > inside.exit) continue;
        met++;
        const Passage through = exact_passage(origin, direction, bounds_of(instances[i], {boxes[i], {}}));
        ASSERT_LE(through.entry, through.exit * 1.000002) << "ray " << i << ", seed " << seed;
        // Neither does it meet the part outside of them.
        const double slack = 1e-6 * (distance + world + 10);
        ASSERT_GE(placed[2 * i].w + inside.exit, through.entry - slack) << "ray " << i << ", seed " << seed;
        ASSERT_LE(placed[2 * i].w + inside.entry, through.exit + slack) << "ray " << i << ", seed " << seed;
    }
    EXPECT_GT(met, count / 100);
    const auto quantile = errors.begin() + count / 1000 * 999;
    std::nth_element(errors.begin(), quantile, errors.end());
    EXPECT_LT(*quantile, largest_error);
    std::printf("world %g, distance %g: %u met, 99.9 %% pass within %.1e of the object's extent\n", world, distance, met, *quantile);
}

INSTANTIATE_TEST_SUITE_P(places, InstanceRays,
                         testing::Values(PlacedCase{0, 3, 5e-6}, PlacedCase{0, 1e4, 5e-6}, PlacedCase{0, 1e6, 5e-6}, PlacedCase{100, 100, 5e-5},
                                         PlacedCase{1e4, 1e6, 5e-3}));

TEST(InstanceRecords, AreRefusedWhereNothingCanBePlaced) {
    Box box;
    box.grow(Float3{-1, -1, -1});
    box.grow(Float3{1, 1, 1});
    EXPECT_TRUE(make_instance(Transform(), box));
    EXPECT_TRUE(make_instance(Transform::scale(1e-6, 1e6, 1), box));
    EXPECT_FALSE(make_instance(Transform::scale(1, 0, 1), box));
    EXPECT_FALSE(make_instance(Transform::scale(1e-42, 1, 1), box)) << "the way back is beyond what floats hold";
    EXPECT_FALSE(make_instance(Transform::translate(1e39, 0, 0), box));
    EXPECT_FALSE(make_instance(Transform::translate(NAN, 0, 0), box));
    EXPECT_FALSE(make_instance(Transform(), Box()));
    Transform projective;
    projective.m[3][0] = 1;
    EXPECT_FALSE(make_instance(projective, box));
}

}  // namespace
}  // namespace raypager
