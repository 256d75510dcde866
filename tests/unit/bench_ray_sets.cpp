// The ray sets of `bench traverse`.
#include <gtest/gtest.h>

#include <cmath>

#include "bench/ray_sets.hpp"

namespace raypager::bench {
namespace {

TEST(RaySets, camera_rays_that_miss_go_on_from_the_ceiling) {
    std::vector<Ray> rays(1000, Ray{{0, 0, 0}, INFINITY, {0, 0, 1}});
    std::vector<SurfacePoint> hits(rays.size());
    for (size_t i = 0; i < hits.size(); i += 3) hits[i] = {true, {1, 2, 3}, {0, 0, -1}, 7, 3};
    const size_t few = diffuse_rays(rays, hits, 1).size();
    EXPECT_EQ(few, 334u);
    const std::vector<SurfacePoint> before = hits;
    end_at_ceiling(rays, hits, {10, 30, 20}, {11, 30, 25}, 3);
    const std::vector<Ray> bounces = diffuse_rays(rays, hits, 1), shadow = shadow_rays(rays, hits, {0, 80, 0}, {1, 80, 1}, 2);
    ASSERT_EQ(bounces.size(), rays.size());
    ASSERT_EQ(shadow.size(), rays.size());
    for (size_t i = 0; i < rays.size(); i++) {
        const Float3 &o = bounces[i].origin, &d = bounces[i].direction;
        if (before[i].hit) {
            EXPECT_EQ(hits[i].position.x, 1) << "hits stay where they are";
            EXPECT_LT(d.z, 0);
            continue;
        }
        EXPECT_TRUE(o.x >= 9.99f && o.x <= 11.01f && std::abs(o.y - 30) < 0.01f && o.z >= 19.99f && o.z <= 25.01f);
        EXPECT_LE(d.y, 0) << "the ceiling looks down";
        EXPECT_GT(shadow[i].direction.y, 0) << "the light is above it";
    }
}

}  // namespace
}  // namespace raypager::bench
