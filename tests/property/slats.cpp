// What a ray hits does not depend on the boxes around it: long thin faces, on which a computed distance is wrong by much more than positions are,
// and rays that begin beside them. Each is traced in all ways, through blocks of two sizes, so through different boxes.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

#include "support/device_scene.hpp"

namespace raypager {
namespace {

constexpr uint32_t seed = 267805;

struct Slat {
    Float3 low, high;
};

class Slats : public testing::Test {
protected:
    float uniform(double low, double high) { return static_cast<float>(std::uniform_real_distribution<double>(low, high)(random_)); }

    // Boxes 24 long, 0.04 high and 0.13 deep, twelve triangles each.
    Scene make_scene(size_t number) {
        TriangleMesh mesh;
        for (size_t i = 0; i < number; i++) {
            const Float3 low = {uniform(-14, -10), uniform(5, 9), uniform(-18, -14)}, high = {low.x + 24, low.y + 0.04f, low.z + 0.13f};
            slats_.push_back({low, high});
            const auto first = static_cast<uint32_t>(mesh.positions.size());
            for (uint32_t k = 0; k < 8; k++) mesh.positions.push_back({k & 1 ? high.x : low.x, k & 2 ? high.y : low.y, k & 4 ? high.z : low.z});
            constexpr std::array<std::array<uint32_t, 4>, 6> faces = {{{0, 1, 3, 2}, {4, 6, 7, 5}, {0, 4, 5, 1}, {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 5, 7, 3}}};
            for (const auto& [a, b, c, d] : faces) {
                mesh.triangles.push_back({first + a, first + b, first + c});
                mesh.triangles.push_back({first + a, first + c, first + d});
            }
        }
        Scene scene;
        scene.materials.resize(1);
        scene.camera = *make_camera({0, 0, -40}, {0, 0, 0}, {0, 1, 0}, 40, scene.width, scene.height);
        Shape shape;
        shape.name = "slats";
        shape.mesh = std::make_shared<MeshInMemory>("slats", std::move(mesh));
        scene.shapes = {shape};
        return scene;
    }

    // From just before or behind one of the four long faces of a slat, in any direction.
    support::ProbeRay make_ray() {
        const Slat& slat = slats_[random_() % slats_.size()];
        const auto between = [&](float low, float high) { return uniform(low, high); };
        Float3 origin = {between(slat.low.x, slat.high.x), between(slat.low.y, slat.high.y), between(slat.low.z, slat.high.z)};
        const float beside = std::exp2(uniform(-20, -10)) * (random_() % 2 ? 1 : -1);
        switch (random_() % 4) {
            case 0: origin.y = slat.low.y + beside; break;
            case 1: origin.y = slat.high.y + beside; break;
            case 2: origin.z = slat.low.z + beside; break;
            default: origin.z = slat.high.z + beside;
        }
        const Float3 way = {uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)};
        const float length = std::sqrt(way.x * way.x + way.y * way.y + way.z * way.z);
        return {origin, INFINITY, {way.x / length, way.y / length, way.z / length}};
    }

    std::mt19937 random_{seed};
    std::vector<Slat> slats_;
};

TEST_F(Slats, are_hit_alike_through_all_boxes) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    const Scene scene = make_scene(400);
    std::vector<support::ProbeRay> rays;
    for (size_t i = 0; i < 200000; i++) rays.push_back(make_ray());
    const support::TemporaryFolder folder;
    std::vector<support::ProbeHit> first;
    for (const uint64_t block_bytes : {16u << 10, 1u << 20})
        for (const Traversal traversal : support::traversals()) {
            SCOPED_TRACE(testing::Message() << "blocks of " << block_bytes << (traversal == Traversal::stream ? ", streams" : ", single rays"));
            BakeOptions options;
            options.block_bytes = block_bytes;
            auto file = support::bake_and_open(scene, options, folder.path(), "slats");
            ASSERT_TRUE(file.ok()) << file.status().message();
            auto device = support::DeviceScene::create(*file, 0, traversal);
            ASSERT_TRUE(device.ok()) << device.status().message();
            auto hits = (*device)->trace(rays);
            ASSERT_TRUE(hits.ok()) << hits.status().message();
            if (first.empty()) first = *hits;
            size_t different = 0, found = 0;
            for (size_t i = 0; i < rays.size(); i++) {
                const support::ProbeHit &a = first[i], &b = (*hits)[i];
                found += b.primitive != RP_NONE;
                different += a.primitive != b.primitive || a.t != b.t || a.occluded != b.occluded;
                EXPECT_EQ(b.occluded != 0, b.primitive != RP_NONE) << "ray " << i;
            }
            EXPECT_EQ(different, 0u);
            EXPECT_GT(found, rays.size() / 4);
        }
}

}  // namespace
}  // namespace raypager
