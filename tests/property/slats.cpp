// Long thin faces, on which a computed distance is wrong by much more than positions are, and rays that begin beside them. What they hit does not
// depend on the boxes around it: each is traced in all ways, through blocks of two sizes, so through different boxes. And they do not pass
// through a face that is clearly in front of them.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <random>
#include <vector>

#include "support/device_scene.hpp"

namespace raypager {
namespace {

constexpr uint32_t seed = 267805;
constexpr size_t ray_count = 200000;

struct Slat {
    Float3 low, high;
};

class Slats : public testing::Test {
protected:
    float uniform(double low, double high) { return static_cast<float>(std::uniform_real_distribution<double>(low, high)(random_)); }

    // A box 24 long, 0.04 high and 0.13 deep.
    void add_slat(const Float3& low) { slats_.push_back({low, {low.x + 24, low.y + 0.04f, low.z + 0.13f}}); }

    // Twelve triangles a slat.
    Scene make_scene() const {
        TriangleMesh mesh;
        for (const auto& [low, high] : slats_) {
            const auto first = static_cast<uint32_t>(mesh.positions.size());
            for (uint32_t k = 0; k < 8; k++) mesh.positions.push_back({k & 1 ? high.x : low.x, k & 2 ? high.y : low.y, k & 4 ? high.z : low.z});
            constexpr std::array<std::array<uint32_t, 4>, 6> faces = {
                {{0, 1, 3, 2}, {4, 6, 7, 5}, {0, 4, 5, 1}, {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 5, 7, 3}}};
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

    // From just before or behind one of the four long faces of a slat, or from beside one of its long edges, in any direction.
    void make_rays() {
        for (size_t i = 0; i < ray_count; i++) {
            const Slat& slat = slats_[random_() % slats_.size()];
            Float3 origin = {uniform(slat.low.x, slat.high.x), uniform(slat.low.y, slat.high.y), uniform(slat.low.z, slat.high.z)};
            const auto beside = [&](float at) { return at + std::exp2(uniform(-21, -10)) * (random_() % 2 ? 1 : -1); };
            const auto face = random_() % 3;  // 2: an edge
            if (face != 0) origin.y = beside(random_() % 2 ? slat.low.y : slat.high.y);
            if (face != 1) origin.z = beside(random_() % 2 ? slat.low.z : slat.high.z);
            const Float3 way = {uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)};
            const float length = std::sqrt(way.x * way.x + way.y * way.y + way.z * way.z);
            rays_.push_back({origin, INFINITY, {way.x / length, way.y / length, way.z / length}});
            near_.push_back(slat);
        }
    }

    // Where a ray surely enters the slat beside which it begins, INFINITY if that is not sure: it begins outside, by more than rounding moves what is
    // up to 24 away (2^-23 of that, and of coordinates up to 18), and is inside for so long that it does not pass an edge.
    double surely(size_t i) const {
        const auto &o = rays_[i].origin, &d = rays_[i].direction;
        const double origin[3] = {o.x, o.y, o.z}, direction[3] = {d.x, d.y, d.z};
        const Float3 &l = near_[i].low, &h = near_[i].high;
        const double low[3] = {l.x, l.y, l.z}, high[3] = {h.x, h.y, h.z};
        double entry = -INFINITY, leave = INFINITY;
        for (int k = 0; k < 3; k++) {
            const double a = (low[k] - origin[k]) / direction[k], b = (high[k] - origin[k]) / direction[k];
            entry = std::max(entry, std::min(a, b));
            leave = std::min(leave, std::max(a, b));
        }
        return entry > 4e-6 && leave - entry > 1e-3 ? entry : INFINITY;
    }

    void compare() {
        SCOPED_TRACE(testing::Message() << "seed " << seed);
        const Scene scene = make_scene();
        make_rays();
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
                auto hits = (*device)->trace(rays_);
                ASSERT_TRUE(hits.ok()) << hits.status().message();
                if (first.empty()) first = *hits;
                size_t different = 0, inconsistent = 0, passed = 0, sure = 0;
                for (size_t i = 0; i < rays_.size(); i++) {
                    const support::ProbeHit &a = first[i], &b = (*hits)[i];
                    different += a.primitive != b.primitive || a.t != b.t || a.occluded != b.occluded;
                    inconsistent += (b.occluded != 0) != (b.primitive != RP_NONE);
                    const double at = surely(i);
                    sure += at < INFINITY;
                    // As far behind as rounding moves a face along a ray that meets it flatly; through the slat it would be 1e-3 at least.
                    passed += at < INFINITY && !(b.primitive != RP_NONE && b.t <= at + 1e-5);
                }
                EXPECT_EQ(different, 0u);
                EXPECT_EQ(inconsistent, 0u);
                EXPECT_EQ(passed, 0u) << "went through a face";
                EXPECT_GT(sure, rays_.size() / 8);
            }
    }

    std::mt19937 random_{seed};
    std::vector<Slat> slats_;
    std::vector<support::ProbeRay> rays_;
    std::vector<Slat> near_;  // for each ray
};

TEST_F(Slats, side_by_side) {
    for (int i = 0; i < 400; i++) add_slat({uniform(-14, -10), uniform(5, 9), uniform(-18, -14)});
    compare();
}

// Blocks that are thin on two axes.
TEST_F(Slats, one_behind_the_other) {
    for (int i = 0; i < 400; i++) add_slat({25.0f * static_cast<float>(i), 7, -16});
    compare();
}

}  // namespace
}  // namespace raypager
