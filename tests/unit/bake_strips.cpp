// Strips and covers: every triangle once, in its own orientation, by the rules of abi/block.h.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

#include "block/strip.hpp"
#include "cut/strip_cover.hpp"
#include "pack/vertex_windows.hpp"
#include "unit/bake_scenes.hpp"

namespace raypager {
namespace {

using namespace blocks_test;

Triangle rotated(Triangle t) {
    std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
    return t;
}

// Decodes a strip by the words of the abi, not by visit_strip: neighbours (B, C, new) or (A, C, new), orientation flipped or kept.
std::vector<Triangle> decode_by_rule(const Strip& strip) {
    std::vector<Triangle> result;
    Triangle listed = {strip.vertices[0], strip.vertices[1], strip.vertices[2]};
    bool clockwise = (strip.flags >> 5 & 1) != 0;
    for (uint32_t k = 0; k < strip.count; k++) {
        if (k > 0) {
            const bool switched = (strip.flags >> (2 + k - 1) & 1) != 0;
            if (!switched) clockwise = !clockwise;
            listed = {switched ? listed[0] : listed[1], listed[2], strip.vertices[k + 2]};
        }
        result.push_back(clockwise ? Triangle{listed[0], listed[2], listed[1]} : listed);
    }
    return result;
}

std::vector<Box4> unit_boxes(size_t count) {
    Box4 box;
    box.grow(Float4{0, 0, 0, 0});
    box.grow(Float4{1, 1, 1, 1});
    return std::vector<Box4>(count, box);
}

void expect_exact_cover(const std::vector<Triangle>& triangles, const std::vector<Strip>& strips) {
    std::vector<int> seen(triangles.size());
    for (const Strip& strip : strips) {
        ASSERT_GE(strip.count, 1u);
        ASSERT_LE(strip.count, RP_LEAF_MAX_PRIMITIVES);
        ASSERT_EQ(strip.flags & 3u, strip.count - 1);
        ASSERT_LT(strip.flags, 64u);
        const auto decoded = decode_by_rule(strip);
        for (uint32_t k = 0; k < strip.count; k++) {
            ASSERT_LT(strip.order[k], triangles.size());
            seen[strip.order[k]]++;
            EXPECT_EQ(rotated(decoded[k]), rotated(triangles[strip.order[k]]));
        }
        uint32_t visited = 0;
        visit_strip(strip.flags, strip.vertices, [&](uint32_t k, uint32_t a, uint32_t b, uint32_t c) {
            EXPECT_EQ(k, visited++);
            EXPECT_EQ(rotated({a, b, c}), rotated(decoded[k]));
        });
        EXPECT_EQ(visited, strip.count);
    }
    for (const int count : seen) EXPECT_EQ(count, 1);
}

TEST(StripCover, RandomSubsetsOfMeshes) {
    constexpr uint32_t seed = 77;
    std::mt19937 random(seed);
    const TriangleMesh meshes[] = {terrain(12), icosphere(2)};
    for (int trial = 0; trial < 300; trial++) {
        SCOPED_TRACE(testing::Message() << "seed " << seed << ", trial " << trial);
        const TriangleMesh& mesh = meshes[trial % 2];
        const size_t count = 1 + random() % most_covered, first = random() % (mesh.triangles.size() - count);
        std::vector<Triangle> triangles(mesh.triangles.begin() + ptrdiff_t(first), mesh.triangles.begin() + ptrdiff_t(first + count));
        // Some inside out, some twice, some with an edge that several share.
        for (Triangle& t : triangles) {
            if (random() % 8 == 0) std::swap(t[0], t[1]);
            if (random() % 16 == 0) t = triangles[random() % triangles.size()];
            if (random() % 16 == 0) t = {t[1], t[2], t[0]};
        }
        expect_exact_cover(triangles, cover_with_strips(triangles, unit_boxes(triangles.size())));
    }
}

// Few vertices and so every kind of coincidence: edges of many triangles, back-to-back triangles, repeated ones.
TEST(StripCover, RandomTrianglesOnFewVertices) {
    constexpr uint32_t seed = 78;
    std::mt19937 random(seed);
    for (int trial = 0; trial < 3000; trial++) {
        SCOPED_TRACE(testing::Message() << "seed " << seed << ", trial " << trial);
        const uint32_t vertices = 3 + random() % 10;
        std::vector<Triangle> triangles(1 + random() % most_covered);
        for (Triangle& t : triangles) {
            do {
                for (uint32_t& v : t) v = random() % vertices;
            } while (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]);
        }
        expect_exact_cover(triangles, cover_with_strips(triangles, unit_boxes(triangles.size())));
    }
}

TEST(StripCover, RegularMeshesFillTheirLeaves) {
    const TriangleMesh mesh = terrain(5);
    const auto strips = cover_with_strips(std::span(mesh.triangles), unit_boxes(mesh.triangles.size()));
    expect_exact_cover(mesh.triangles, strips);
    // 50 triangles: 13 leaves at best; 15 is what keeps the bytes a triangle below 22.
    EXPECT_LE(strips.size(), 15u);
}

TEST(StripCover, InconsistentNeighboursDoNotShareALeaf) {
    const std::vector<Triangle> triangles = {{0, 1, 2}, {1, 2, 3}};  // both run along 1 -> 2
    EXPECT_EQ(cover_with_strips(triangles, unit_boxes(2)).size(), 2u);
    const std::vector<Triangle> consistent = {{0, 1, 2}, {2, 1, 3}};
    EXPECT_EQ(cover_with_strips(consistent, unit_boxes(2)).size(), 1u);
}

TEST(VertexWindows, EveryReferenceLeadsToItsVertex) {
    constexpr uint32_t seed = 5;
    std::mt19937 random(seed);
    for (int trial = 0; trial < 20; trial++) {
        SCOPED_TRACE(testing::Message() << "seed " << seed << ", trial " << trial);
        // From strips that go round in circles to such that never use a vertex again.
        const uint32_t vertices = 10 + random() % 3000, step = random() % 40;
        VertexWindows windows(vertices);
        std::vector<std::pair<VertexWindows::Reference, std::array<uint32_t, 6>>> references;
        for (uint32_t i = 0; i < 2000; i++) {
            const uint32_t count = 3 + random() % 4;
            std::array<uint32_t, 6> strip = {};
            for (uint32_t k = 0; k < 6; k++) strip[k] = k < count ? (i * step + random() % 300) % vertices : strip[count - 1];
            references.push_back({windows.place(strip.data(), count), strip});
        }
        for (const auto& [reference, strip] : references) {
            ASSERT_EQ(reference.first % RP_CLUSTER_UNIT, 0u);
            for (int k = 0; k < 6; k++) ASSERT_EQ(windows.sequence().at(reference.first + reference.bytes[k]), strip[k]);
        }
    }
}

TEST(VertexWindows, AppendsNothingWhileAllIsNear) {
    VertexWindows windows(100);
    for (uint32_t i = 0; i < 1000; i++) {
        const uint32_t strip[3] = {i % 100, (i + 1) % 100, (i + 2) % 100};
        windows.place(strip, 3);
    }
    EXPECT_EQ(windows.sequence().size(), 100u);
}

}  // namespace
}  // namespace raypager
