// The visit log's events become paths, rays and visits again.
#include <gtest/gtest.h>

#include <set>

#include "raypager/abi/visits.h"
#include "wavefront/visit_recorder.hpp"

namespace raypager {
namespace {

// The events of one round, as kernels write them.
class Log {
public:
    void add(uint32_t pixel, uint32_t kind, uint32_t block, uint32_t sample = 0) {
        words_.insert(words_.end(), {pixel, sample, kind << RP_VISIT_KIND_SHIFT | (block & RP_VISIT_BLOCK_MASK)});
    }
    const std::vector<uint32_t>& words() const { return words_; }

private:
    std::vector<uint32_t> words_;
};

constexpr uint32_t none = RP_VISIT_NO_BLOCK;

std::vector<uint32_t> blocks_of(const DemandTrace& trace, size_t ray) {
    std::vector<uint32_t> blocks;
    for (const Visit& visit : trace.visits_of(trace.rays.at(ray))) blocks.push_back(visit.block());
    return blocks;
}

TEST(VisitRecorder, puts_rays_together_over_rounds) {
    VisitRecorder recorder(4, 1, {16, 1, 0, 0});
    Log first, second;
    first.add(2, RP_VISIT_BEGIN_EXTEND, none);
    first.add(1, RP_VISIT_BEGIN_EXTEND, 7);  // between the events of another path
    first.add(2, RP_VISIT_ENTER, 5);
    first.add(2, RP_VISIT_ENTER, 5);  // another block entry of the same block
    first.add(2, RP_VISIT_ENTER, 6);
    first.add(1, RP_VISIT_ENTER, 7);
    second.add(2, RP_VISIT_RESUME_EXTEND, 8);
    second.add(2, RP_VISIT_ENTER, 8);
    second.add(2, RP_VISIT_BEGIN_EXTEND, none);  // a bounce into the void
    recorder.take(first.words());
    recorder.take(second.words());
    EXPECT_EQ(recorder.path_count(), 2u);
    DemandTrace trace;
    recorder.finish(trace);
    ASSERT_EQ(trace.path_rays, (std::vector<uint64_t>{0, 1, 3}));  // pixel 1 before pixel 2
    EXPECT_EQ(blocks_of(trace, 0), std::vector<uint32_t>{7});
    EXPECT_EQ(blocks_of(trace, 1), (std::vector<uint32_t>{5, 6, 8}));
    EXPECT_EQ(blocks_of(trace, 2), std::vector<uint32_t>{});
    EXPECT_EQ(trace.rays[1].hit_block, 8u);
    EXPECT_EQ(trace.rays[2].hit_block, RP_NONE);
    EXPECT_FALSE(trace.rays[1].shadow);
}

TEST(VisitRecorder, a_shadow_ray_that_begins_anew_counts_once) {
    VisitRecorder recorder(1, 1, {16, 1, 0, 0});
    Log log;
    log.add(0, RP_VISIT_BEGIN_EXTEND, 1);
    log.add(0, RP_VISIT_ENTER, 1);
    log.add(0, RP_VISIT_BEGIN_SHADOW, none);  // the log was full behind the first candidate
    log.add(0, RP_VISIT_ENTER, 2);
    log.add(0, RP_VISIT_BEGIN_SHADOW, 3);
    for (const uint32_t block : {2u, 3u, 4u}) log.add(0, RP_VISIT_ENTER, block);
    log.add(0, RP_VISIT_STOPS, 4);
    log.add(0, RP_VISIT_BEGIN_EXTEND, none);
    recorder.take(log.words());
    DemandTrace trace;
    recorder.finish(trace);
    ASSERT_EQ(trace.rays.size(), 3u);
    EXPECT_TRUE(trace.rays[1].shadow);
    EXPECT_EQ(blocks_of(trace, 1), (std::vector<uint32_t>{2, 3, 4}));
    const auto visits = trace.visits_of(trace.rays[1]);
    EXPECT_FALSE(visits[0].stops());
    EXPECT_TRUE(visits[1].stops());
    EXPECT_TRUE(visits[2].stops());
}

TEST(VisitRecorder, paths_come_pass_by_pass_and_tile_by_tile) {
    VisitRecorder recorder(5, 3, {2, 1, 0, 0});
    Log log;
    for (const uint32_t sample : {1u, 0u})
        for (uint32_t pixel = 0; pixel < 15; pixel++) log.add(pixel, RP_VISIT_BEGIN_EXTEND, pixel, sample);
    recorder.take(log.words());
    DemandTrace trace;
    recorder.finish(trace);
    std::vector<uint32_t> pixels;
    for (const TracedRay& ray : trace.rays) pixels.push_back(ray.hit_block);
    const std::vector<uint32_t> pass = {0, 1, 5, 6, 2, 3, 7, 8, 4, 9, 10, 11, 12, 13, 14};
    std::vector<uint32_t> expected = pass;
    expected.insert(expected.end(), pass.begin(), pass.end());
    EXPECT_EQ(pixels, expected);
}

}  // namespace
}  // namespace raypager
