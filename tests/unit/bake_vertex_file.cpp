// Vertices of a mesh that is too large for memory.
#include <gtest/gtest.h>

#include <random>

#include "gather/vertex_file.hpp"
#include "support/temporary_folder.hpp"

namespace raypager {
namespace {

TEST(VertexFile, FindsEveryCorner) {
    constexpr uint32_t seed = 3, count = 20000;
    std::mt19937 random(seed);
    const support::TemporaryFolder folder;
    for (const VertexAttributes attributes : {VertexAttributes{}, {.colors = true}, {.colors = true, .uvs = true}, {.uvs = true}}) {
        auto file = VertexFile::create(folder / "mesh");
        ASSERT_TRUE(file.ok()) << file.status().message();
        std::vector<VertexBits> vertices(count);
        for (uint32_t i = 0; i < count; i++)
            vertices[i] = {{float(i), float(random()), 3}, i * 7, attributes.colors ? i : RP_NONE, attributes.uvs ? Float2{1, float(i)} : Float2{}};
        for (size_t first = 0; first < count; first += 777)
            ASSERT_TRUE(file->append(std::span(vertices).subspan(first, std::min<size_t>(777, count - first)), attributes).ok());
        ASSERT_EQ(file->size(), count);
        std::vector<Triangle> triangles(30000);
        for (Triangle& t : triangles) t = {uint32_t(random() % count), uint32_t(random() % count), uint32_t(random() % 5)};
        triangles.back() = {count - 1, 0, count - 1};
        std::vector<VertexBits> corners(3 * triangles.size());
        ASSERT_TRUE(file->fetch(triangles, corners).ok());
        for (size_t i = 0; i < corners.size(); i++) {
            const VertexBits& expected = vertices[triangles[i / 3][i % 3]];
            ASSERT_TRUE(corners[i].position == expected.position && corners[i].normal == expected.normal && corners[i].color == expected.color &&
                        corners[i].uv == expected.uv)
                << "seed " << seed << ", corner " << i;
        }
    }
}

}  // namespace
}  // namespace raypager
