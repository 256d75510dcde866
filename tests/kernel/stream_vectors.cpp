// kernels/stream/vector.cl has portable and special forms: both do what their comments say.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <random>

#include "support/device_scene.hpp"
#include "support/probe_kernels.hpp"
#include "support/small_scene.hpp"

namespace raypager {
namespace {

constexpr uint32_t lanes = 16, words = 126;  // see rp_probe_vectors

class SmallVectors : public testing::TestWithParam<const char*> {};

TEST_P(SmallVectors, do_what_scalars_do) {
    if (support::traversals().size() == 1) GTEST_SKIP() << "this device does not trace in streams";
    const uint32_t seed = std::random_device{}();
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    constexpr uint32_t count = 64;
    std::vector<float> numbers(count * lanes);
    std::vector<uint32_t> indices(count * lanes);
    for (float& number : numbers) number = std::uniform_real_distribution<float>(-1, 1)(random);
    for (uint32_t& index : indices) index = static_cast<uint32_t>(random() % lanes);
    auto device = Device::open("", 0);
    ASSERT_TRUE(device.ok()) << device.status().message();
    auto kernel = support::probe_kernel(**device, "stream/probe", "rp_probe_vectors", std::string("-DRP_SLABS=1 -DRP_STACK_SIZE=96") + GetParam());
    ASSERT_TRUE(kernel.ok()) << kernel.status().message();
    auto number_buffer = (*device)->upload(bytes_of(numbers), "numbers"), index_buffer = (*device)->upload(bytes_of(indices), "indices");
    std::vector<uint32_t> results(count * words);
    auto result_buffer = (*device)->allocate(results.size() * sizeof(uint32_t), "results");
    ASSERT_TRUE(number_buffer.ok() && index_buffer.ok() && result_buffer.ok());
    ASSERT_TRUE(kernel->set(*number_buffer, *index_buffer, *result_buffer).ok());
    ASSERT_TRUE((*device)->kernels().launch(*kernel, count, 1).ok());
    ASSERT_TRUE((*device)->kernels().read_now(*result_buffer, 0, std::as_writable_bytes(std::span(results))).ok());
    for (uint32_t i = 0; i < count; i++) {
        const float* v = &numbers[i * lanes];
        const uint32_t* out = &results[i * words];
        uint32_t mask = 0;
        for (uint32_t k = 0; k < lanes; k++) mask |= v[k] > 0 ? 1u << k : 0u;
        EXPECT_EQ(out[0], mask);
        EXPECT_EQ(out[1], mask & 255u);
        EXPECT_EQ(out[2], mask);
        EXPECT_EQ(out[3], static_cast<uint32_t>(std::countr_zero(mask | uint64_t{1} << 40)));
        EXPECT_EQ(std::bit_cast<float>(out[4]), *std::min_element(v, v + lanes));
        EXPECT_EQ(std::bit_cast<float>(out[5]), *std::max_element(v, v + lanes));
        for (uint32_t k = 0; k < lanes; k++) EXPECT_EQ(std::bit_cast<float>(out[6 + k]), v[indices[i * lanes + k]]) << "lane " << k;
        std::vector<uint32_t> sorted;
        for (uint32_t k = 0; k < 8; k++) {
            for (const uint32_t half : {22u, 23u}) EXPECT_EQ(std::bit_cast<float>(out[half + 2 * k]), v[indices[i * lanes + k] % 8]) << "lane " << k;
            sorted.push_back(std::bit_cast<uint32_t>(v[k]));
            EXPECT_EQ(std::bit_cast<float>(out[46 + k]), v[indices[i * lanes + k] % 8]) << "lane " << k;
            EXPECT_EQ(std::bit_cast<float>(out[54 + k]), v[indices[i * lanes + k]]) << "lane " << k;
        }
        for (uint32_t row = 0; row < 8; row++)
            for (uint32_t k = 0; k < 8; k++) EXPECT_EQ(out[62 + 8 * k + row], indices[i * lanes + 8 * (row % 2) + k] + 64 * row) << "row " << row;
        std::sort(sorted.begin(), sorted.end(), std::greater<>());
        EXPECT_EQ(std::vector(out + 38, out + 46), sorted);
    }
}

// Rays alone or in packets, with the instructions of this device or without (then a ray alone tests eight triangles at a time): the same bits.
TEST(SmallStreams, find_the_same_hits_in_all_their_forms) {
    if (support::traversals().size() == 1) GTEST_SKIP() << "this device does not trace in streams";
    support::TemporaryFolder folder;
    BakeOptions options;
    options.block_bytes = 1 << 16;
    const auto file = support::bake_and_open(support::small_scene(24), options, folder.path(), "small");
    ASSERT_TRUE(file.ok()) << file.status().message();
    auto scene = support::DeviceScene::create(*file, 0, Traversal::stream);
    ASSERT_TRUE(scene.ok()) << scene.status().message();
    std::mt19937 random(11);
    std::normal_distribution<float> normal;
    std::vector<support::ProbeRay> rays;
    for (uint32_t i = 0; i < 960; i++) {
        // In turn: neighbours that go the same way, and rays that have nothing in common.
        const float spread = i / 192 % 2 ? 1.0f : 0.02f;
        const Float3 origin = {3 + spread * normal(random), 3 + spread * normal(random), spread * normal(random)};
        rays.push_back(
            {origin, INFINITY, {spread * normal(random) - origin.x, spread * normal(random) - origin.y, spread * normal(random) - origin.z}});
    }
    const auto hits = (*scene)->trace(rays);
    ASSERT_TRUE(hits.ok()) << hits.status().message();
    const std::string packets = " -DRP_DENSE_TRIANGLES=1 -DRP_DENSE_BOXES=1", alone = " -DRP_DENSE_TRIANGLES=65 -DRP_DENSE_BOXES=65";
    const std::string portable = " -DRP_PORTABLE", eight = " -DRP_EIGHT_LANES=1";
    const std::string surfaces_of_eight = " -DRP_SURFACE_HITS=8", surfaces_of_sixteen = " -DRP_SURFACE_HITS=16";
    for (const std::string& form :
         {portable, packets, alone, alone + eight + surfaces_of_eight, packets + portable, alone + portable + surfaces_of_sixteen}) {
        SCOPED_TRACE(form);
        const auto others = (*scene)->trace(rays, form);
        ASSERT_TRUE(others.ok()) << others.status().message();
        for (size_t i = 0; i < rays.size(); i++) {
            const support::ProbeHit &a = (*hits)[i], &b = (*others)[i];
            EXPECT_EQ(std::bit_cast<uint32_t>(a.t), std::bit_cast<uint32_t>(b.t)) << i;
            EXPECT_EQ(a.primitive, b.primitive) << i;
            EXPECT_EQ(a.occluded, b.occluded) << i;
            EXPECT_EQ(a.normal, b.normal) << i;
            EXPECT_TRUE(a.position.x == b.position.x && a.position.y == b.position.y && a.position.z == b.position.z) << i;
        }
    }
    uint32_t found = 0;
    for (const support::ProbeHit& hit : *hits) found += std::isfinite(hit.t);
    EXPECT_GT(found, rays.size() / 4);
    EXPECT_LT(found, rays.size());
}

INSTANTIATE_TEST_SUITE_P(forms, SmallVectors, testing::Values("", " -DRP_PORTABLE"),
                         [](const auto& param) { return std::string(*param.param ? "portable" : "of_the_device"); });

}  // namespace
}  // namespace raypager
