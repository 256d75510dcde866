// How meshes that are read beforehand share the workers.
#include <gtest/gtest.h>

#include <algorithm>

#include "gather/mesh_prefetch.hpp"

namespace raypager {
namespace {

TEST(MeshPrefetch, gives_a_mesh_its_share_of_the_workers) {
    EXPECT_EQ(workers_for_mesh(16, 1000, 0), 16u) << "the last one";
    EXPECT_EQ(workers_for_mesh(16, 0, 0), 16u) << "the last one, which lies in memory";
    EXPECT_EQ(workers_for_mesh(16, 1'000'000, 100), 16u) << "one with its ground";
    EXPECT_EQ(workers_for_mesh(16, 100, 1'000'000), 1u) << "that ground";
    EXPECT_EQ(workers_for_mesh(1, 1000, 1000), 1u);
    EXPECT_EQ(workers_for_mesh(64, UINT64_MAX / 2, UINT64_MAX / 2), 32u);
    // However many equal ones there are, they have about all workers among them.
    for (const uint64_t meshes : {2u, 5u, 32u, 64u, 1000u}) {
        const size_t each = workers_for_mesh(64, 1000, 1000 * (meshes - 1)), at_once = std::min<size_t>(64, meshes);
        EXPECT_GE(each * at_once, 60u) << meshes;
        EXPECT_LE(each * at_once, 96u) << meshes;
    }
}

}  // namespace
}  // namespace raypager
