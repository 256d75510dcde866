// Demand traces come back from their file as they were, and a damaged file is an error that names it, never another trace.
#include <gtest/gtest.h>

#include <cstring>
#include <fstream>
#include <sstream>

#include "base/hash.hpp"
#include "bench_traces.hpp"
#include "support/device_scene.hpp"

namespace raypager {
namespace {

std::string read_file(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    std::ostringstream text;
    text << file.rdbuf();
    return text.str();
}

void write_file(const std::filesystem::path& path, const std::string& bytes) { std::ofstream(path, std::ios::binary) << bytes; }

class DemandTraceFile : public testing::Test {
protected:
    support::TemporaryFolder folder_;
    std::filesystem::path path_ = folder_.path() / "demand.trace";
};

TEST_F(DemandTraceFile, comes_back_as_it_was) {
    for (const uint64_t seed : {1, 2, 3}) {
        SCOPED_TRACE(testing::Message() << "seed " << seed);
        DemandTrace trace = random_trace(seed, {.blocks = 300, .paths = 200});
        trace.recorded.policy = default_settings(PolicyKind::most_wanted);
        trace.recorded.policy.evict_ahead = 16;
        trace.recorded.policy.loads_while_idle = 128;
        trace.recorded.policy.traffic_kept = 0.75;
        trace.recorded.wait_for_loads = true;
        trace.recorded.cpu_cores = 0;
        trace.recorded.rounds_under_way = 2;
        ASSERT_TRUE(write_demand_trace(path_, trace).ok());
        const auto read = read_demand_trace(path_);
        ASSERT_TRUE(read.ok()) << read.status().message();
        EXPECT_EQ(read->block_bytes, trace.block_bytes);
        EXPECT_EQ(read->path_rays, trace.path_rays);
        ASSERT_EQ(read->rays.size(), trace.rays.size());
        for (size_t i = 0; i < trace.rays.size(); i++) {
            const TracedRay &a = read->rays[i], &b = trace.rays[i];
            ASSERT_TRUE(a.first_visit == b.first_visit && a.visits == b.visits && a.shadow == b.shadow && a.hit_block == b.hit_block) << "ray " << i;
        }
        ASSERT_EQ(read->visits.size(), trace.visits.size());
        for (size_t i = 0; i < trace.visits.size(); i++) ASSERT_EQ(read->visits[i].word, trace.visits[i].word) << "visit " << i;
        const RecordedRender &a = read->recorded, &b = trace.recorded;
        EXPECT_EQ(a.device, b.device);
        EXPECT_EQ(a.policy.kind, PolicyKind::most_wanted);
        EXPECT_EQ(a.policy.loads_in_flight, b.policy.loads_in_flight);
        EXPECT_EQ(a.policy.max_age, b.policy.max_age);
        EXPECT_EQ(a.policy.evict_ahead, 16u);
        EXPECT_EQ(a.policy.loads_while_idle, 128u);
        EXPECT_EQ(a.policy.traffic_kept, 0.75);
        EXPECT_EQ(a.policy.hold_above_ready, b.policy.hold_above_ready);
        EXPECT_TRUE(a.wait_for_loads);
        EXPECT_EQ(a.cpu_cores, 0u);
        EXPECT_EQ(a.rounds_under_way, 2u);
        EXPECT_EQ(std::tuple(a.pool_bytes, a.slab_bytes, a.slots, a.paths, a.rays, a.loads, a.bytes_loaded, a.rounds, a.scene_identity),
                  std::tuple(b.pool_bytes, b.slab_bytes, b.slots, b.paths, b.rays, b.loads, b.bytes_loaded, b.rounds, b.scene_identity));
        EXPECT_EQ(a.seconds, b.seconds);
        EXPECT_EQ(a.trace_seconds, b.trace_seconds);
    }
}

TEST_F(DemandTraceFile, is_small) {
    const DemandTrace trace = random_trace(4, {.blocks = 60, .paths = 2000});
    ASSERT_TRUE(write_demand_trace(path_, trace).ok());
    // A byte a visit and two to three a ray, for blocks whose numbers are near each other.
    EXPECT_LT(std::filesystem::file_size(path_), 2 * trace.visits.size() + 3 * trace.rays.size() + 2000);
}

TEST_F(DemandTraceFile, every_damaged_byte_is_noticed) {
    ASSERT_TRUE(write_demand_trace(path_, random_trace(5, {.blocks = 5, .paths = 8})).ok());
    const std::string whole = read_file(path_);
    for (size_t at = 0; at < whole.size(); at++) {
        std::string damaged = whole;
        damaged[at] = static_cast<char>(damaged[at] ^ 0x10);
        write_file(path_, damaged);
        const auto read = read_demand_trace(path_);
        ASSERT_FALSE(read.ok()) << "byte " << at;
        EXPECT_NE(read.status().message().find("demand.trace"), std::string::npos) << read.status().message();
    }
    for (size_t length = 0; length < whole.size(); length += 7) {
        write_file(path_, whole.substr(0, length));
        EXPECT_FALSE(read_demand_trace(path_).ok()) << length << " bytes";
    }
    EXPECT_FALSE(read_demand_trace(folder_.path() / "absent.trace").ok());
}

// Whoever can write a checksum can write nonsense under it: an error again, and no allocation out of proportion.
TEST_F(DemandTraceFile, nonsense_with_a_good_checksum_is_refused) {
    ASSERT_TRUE(write_demand_trace(path_, random_trace(6, {.blocks = 5, .paths = 20})).ok());
    const std::string whole = read_file(path_);
    size_t refused = 0, tried = 0;
    const uint64_t seed = 6;
    std::mt19937_64 random(seed);
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    for (; tried < 500; tried++) {
        std::string damaged = whole;
        const size_t at = 32 + random() % (whole.size() - 32);
        damaged[at] = static_cast<char>(random());
        const uint64_t checksum = hash64(std::string_view(damaged).substr(32));
        std::memcpy(damaged.data() + 24, &checksum, sizeof checksum);
        write_file(path_, damaged);
        const auto read = read_demand_trace(path_);
        refused += !read.ok();
        if (!read.ok()) continue;
        // What is taken holds together.
        for (const Visit& visit : read->visits) ASSERT_LT(visit.block(), read->block_bytes.size());
        ASSERT_EQ(read->path_rays.back(), read->rays.size());
    }
    EXPECT_GT(refused, tried / 20);
}

}  // namespace
}  // namespace raypager
