// The box tests of the stream kernels are conservative: whatever a ray meets inside a box in exact arithmetic, the box in a wide node lets
// it through, and says that it is entered no later than that, whether the ray is tested alone or among others. Rays from near and very
// far, boxes flat and thick, near the origin and far from it.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <random>

#include "block/wide_node.hpp"
#include "property/passage.hpp"
#include "support/device_scene.hpp"
#include "support/probe_kernels.hpp"

namespace raypager {
namespace {

constexpr uint32_t stream = 64, children = RP_WIDE_CHILDREN;

// Nodes with their boxes before they were quantised, and 64 rays each that are aimed at them.
class Trial {
public:
    Trial(uint64_t seed, double scale) : random_(seed), scale_(scale) {}

    void add_node() {
        const double away = chance(0.5) ? 0 : std::ldexp(scale_, static_cast<int>(unit() * 12));
        double base[3];
        for (double& coordinate : base) coordinate = (unit() - 0.5) * 2 * away;
        const size_t count = 1 + random_() % children, first = boxes.size();
        double size = scale_;
        if (chance(0.3)) size *= std::pow(unit(), 6);  // far smaller than its distance from the origin
        for (size_t k = 0; k < count; k++) boxes.push_back(make_box(base, size));
        begins.push_back(first);
        rp_wide_node node = {};
        quantise(std::span(boxes).subspan(first), node);
        nodes.push_back(node);
        // Rays of one packet are tested together where the signs of their directions agree.
        const int signs = chance(0.6) ? static_cast<int>(random_() % 8) : -1;
        for (uint32_t r = 0; r < stream; r++) add_ray(boxes[first + random_() % count], signs);
    }

    std::vector<rp_wide_node> nodes;
    std::vector<Box> boxes;                  // of all nodes
    std::vector<size_t> begins;              // of each node's boxes
    std::vector<std::array<float, 4>> rays;  // origin, direction

private:
    double unit() { return std::uniform_real_distribution<double>(0, 1)(random_); }
    bool chance(double share) { return unit() < share; }

    Box make_box(const double (&base)[3], double size) {
        Box box;
        for (int k = 0; k < 3; k++) {
            const double begin = base[k] + size * unit(), extent = chance(0.15) ? 0 : size * std::pow(unit(), 3);
            box.lower[k] = static_cast<float>(begin);
            box.upper[k] = std::max(box.lower[k], static_cast<float>(begin + extent));
        }
        return box;
    }

    // Through a point of the box, from close by or from up to a million times the largest coordinate away (from farther, floats cannot
    // tell the scene from a point).
    void add_ray(const Box& box, int signs) {
        float largest = 0;
        for (int k = 0; k < 3; k++) largest = std::max({largest, std::abs(box.lower[k]), std::abs(box.upper[k])});
        const double far = chance(0.2) ? 0 : std::ldexp(largest, static_cast<int>(unit() * 24) - 4);
        std::array<float, 4> origin = {0, 0, 0, INFINITY}, direction = {};
        double length = 0;
        for (int k = 0; k < 3; k++) {
            const float point =
                std::clamp(static_cast<float>(box.lower[k] + (double(box.upper[k]) - box.lower[k]) * unit()), box.lower[k], box.upper[k]);
            const double step = signs < 0 ? unit() - 0.5 : (signs >> k & 1 ? 0.5 : -0.5) * unit();
            origin[k] = chance(0.2) ? point : static_cast<float>(point + far * step);
            direction[k] = static_cast<float>(double(point) - origin[k]);
            length += double(direction[k]) * direction[k];
        }
        for (int k = 0; k < 3; k++)  // rays have unit directions
            direction[k] = length > 0 ? static_cast<float>(direction[k] / std::sqrt(length)) : k == 0 ? 1.0f : 0.0f;
        rays.push_back(origin);
        rays.push_back(direction);
    }

    std::mt19937_64 random_;
    double scale_;
};

struct Found {
    std::vector<uint64_t> met;  // 24 a node, see rp_probe_wide_boxes
    std::vector<float> entry;
};

Found run_kernel(const Trial& trial) {
    Found found;
    const size_t count = trial.nodes.size();
    found.met.resize(24 * count);
    found.entry.resize(24 * count);
    auto device = Device::open("", 0);
    EXPECT_TRUE(device.ok()) << device.status().message();
    auto kernel = support::probe_kernel(**device, "stream/probe", "rp_probe_wide_boxes", "-DRP_SLABS=1 -DRP_STACK_SIZE=96");
    EXPECT_TRUE(kernel.ok()) << kernel.status().message();
    auto rays = (*device)->upload(bytes_of(trial.rays), "rays"), nodes = (*device)->upload(bytes_of(trial.nodes), "nodes");
    auto met = (*device)->allocate(found.met.size() * sizeof(uint64_t), "masks");
    auto entry = (*device)->allocate(found.entry.size() * sizeof(float), "entries");
    EXPECT_TRUE(rays.ok() && nodes.ok() && met.ok() && entry.ok());
    EXPECT_TRUE(kernel->set(*rays, *nodes, *met, *entry).ok());
    EXPECT_TRUE((*device)->kernels().launch(*kernel, count, 1).ok());
    EXPECT_TRUE((*device)->kernels().read_now(*met, 0, std::as_writable_bytes(std::span(found.met))).ok());
    EXPECT_TRUE((*device)->kernels().read_now(*entry, 0, std::as_writable_bytes(std::span(found.entry))).ok());
    return found;
}

class WideBoxTest : public testing::TestWithParam<int> {};

TEST_P(WideBoxTest, lets_every_ray_through_that_meets_the_box) {
    if (support::traversals().size() == 1) GTEST_SKIP() << "this device does not trace in streams";
    const int scale_exponent = GetParam();
    const uint64_t seed = 8311 + static_cast<uint64_t>(scale_exponent + 50);
    Trial trial(seed, std::ldexp(1.0, scale_exponent));
    constexpr uint32_t count = 4000;
    for (uint32_t i = 0; i < count; i++) trial.add_node();
    const Found found = run_kernel(trial);
    if (HasFailure()) return;
    uint64_t meetings = 0, let_through = 0, pairs = 0;
    for (uint32_t i = 0; i < count; i++) {
        const size_t begin = trial.begins[i], end = i + 1 < count ? trial.begins[i + 1] : trial.boxes.size();
        for (uint32_t way = 0; way < 3; way++) {
            const size_t results = 24 * size_t{i} + 8 * way;
            for (size_t k = 0; k < children; k++) {
                const uint64_t met = found.met[results + k];
                if (way == 2) {
                    ASSERT_EQ(met, found.met[results - 8 + k]) << "a ray alone is not tested as among others, node " << i << ", seed " << seed;
                    if (met != 0) {
                        ASSERT_EQ(found.entry[results + k], found.entry[results - 8 + k]) << "node " << i << ", seed " << seed;
                    }
                }
                if (begin + k >= end) {
                    ASSERT_EQ(met, 0u) << "a child that is not there is met, node " << i << ", seed " << seed;
                    continue;
                }
                pairs += stream;
                let_through += static_cast<uint64_t>(std::popcount(met));
                for (uint32_t r = 0; r < stream; r++) {
                    const size_t ray = 2 * (size_t{stream} * i + r);
                    const Passage truth = exact_passage(trial.rays[ray].data(), trial.rays[ray + 1].data(), trial.boxes[begin + k]);
                    if (truth.entry > truth.exit) continue;
                    meetings++;
                    ASSERT_TRUE(met >> r & 1) << fmt::format("node {} child {} ray {} way {} was missed, seed {}: truly met from {} to {}", i, k, r,
                                                             way, seed, truth.entry, truth.exit);
                    // Hits in the box are not before its entry; traversal compares with the same widening.
                    ASSERT_LE(found.entry[results + k], truth.exit * 1.000002 + 1e-30) << "node " << i << " child " << k << ", seed " << seed;
                }
            }
        }
    }
    EXPECT_GT(meetings, uint64_t{count} * stream) << "seed " << seed;
    EXPECT_LT(let_through, pairs * 9 / 10) << "everything passes: the test shows nothing, seed " << seed;
}

INSTANTIATE_TEST_SUITE_P(scales, WideBoxTest, testing::Values(-40, -10, 0, 10, 30),
                         [](const auto& param) { return (param.param < 0 ? "minus_" : "plus_") + std::to_string(std::abs(param.param)); });

// Stored boxes hold the boxes that they stand for, with their slack, and are not much larger than a cell of 1/255 demands.
TEST(WideNode, StoredBoxesHoldTheirs) {
    for (const int exponent : {-60, -20, 0, 40}) {
        Trial trial(77, std::ldexp(1.0, exponent));
        for (int i = 0; i < 2000; i++) trial.add_node();
        for (size_t i = 0; i < trial.nodes.size(); i++) {
            const rp_wide_node& node = trial.nodes[i];
            for (uint32_t k = 0; k < node.count; k++) {
                const Box stored = stored_box(node, k);
                const Box& box = trial.boxes[trial.begins[i] + k];
                for (int a = 0; a < 3; a++) {
                    const double slack = (double(box.upper[a]) - box.lower[a]) * RP_WIDE_SLACK_OF_EXTENT;
                    ASSERT_LE(stored.lower[a], box.lower[a] - slack) << "node " << i << " child " << k << " axis " << a;
                    ASSERT_GE(stored.upper[a], box.upper[a] + slack) << "node " << i << " child " << k << " axis " << a;
                }
            }
        }
    }
}

}  // namespace
}  // namespace raypager
