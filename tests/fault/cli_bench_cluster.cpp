// The simulation of clusters as users of the command line meet it.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <algorithm>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "residency/demand_trace.hpp"
#include "support/small_scene_file.hpp"
#include "support/temporary_folder.hpp"

namespace raypager {
namespace {

class CliBenchCluster : public testing::Test {
protected:
    // Paths of two rays, each through two of ten blocks.
    void SetUp() override {
        DemandTrace trace;
        trace.block_bytes.assign(10, 65536);
        for (uint32_t path = 0; path < 500; path++) {
            for (uint32_t ray = 0; ray < 2; ray++) {
                const uint32_t block = path / 25 % 10;
                trace.rays.push_back({trace.visits.size(), 2, false, block});
                for (const uint32_t visit : {(block + ray + 1) % 10, block}) trace.visits.push_back(Visit::of(visit, false));
            }
            trace.path_rays.push_back(trace.rays.size());
        }
        trace.recorded.device = "a device";
        trace.recorded.pool_bytes = trace.geometry_bytes();
        trace.recorded.slots = 64;
        trace.recorded.paths = trace.path_count(), trace.recorded.rays = trace.rays.size();
        trace.recorded.seconds = trace.recorded.trace_seconds = 1;
        ASSERT_TRUE(write_demand_trace(folder_ / "t.trace", trace).ok());
        trace.path_rays = {0}, trace.rays.clear(), trace.visits.clear();
        ASSERT_TRUE(write_demand_trace(folder_ / "none.trace", trace).ok());
    }
    int run(const std::string& arguments) const {
        const int raw = std::system(
            fmt::format("cd '{}' && timeout 120 '{}' bench cluster >.stdout 2>.stderr </dev/null {}", folder_.string(), RAYPAGER_PROGRAM, arguments)
                .c_str());
        return WIFEXITED(raw) ? WEXITSTATUS(raw) : -1;
    }
    std::string file(const char* name) const { return support::read_file(folder_ / name); }

    const support::TemporaryFolder temporary_;
    const std::filesystem::path folder_ = temporary_.path();
};

TEST_F(CliBenchCluster, SaysWhatEachClusterTakes) {
    ASSERT_EQ(run("t.trace --nodes 1,4 --links 1M,1G --pool 20% --host-limit 50% --repeats 8 --samples 4000 --report r.json"), 0) << file(".stderr");
    EXPECT_NE(file(".stdout").find("efficiency"), std::string::npos) << file(".stdout");
    const auto report = nlohmann::json::parse(file("r.json"), nullptr, false);
    ASSERT_TRUE(report.is_object());
    EXPECT_EQ(report["store_bytes"], 655360);
    EXPECT_EQ(report["replayed_share"], 1.0);
    ASSERT_EQ(report["rows"].size(), 4u);
    for (const auto& row : report["rows"]) {
        EXPECT_EQ(row["rays"], 8000);
        EXPECT_EQ(row["bytes_loaded"].get<uint64_t>(), row["bytes_from_cache"].get<uint64_t>() + row["bytes_from_own_shard"].get<uint64_t>() +
                                                           row["bytes_from_disk"].get<uint64_t>() + row["bytes_received"].get<uint64_t>());
    }
    const auto &slow = report["rows"][1], &quick = report["rows"][3];
    EXPECT_EQ(slow["nodes"], 4);
    EXPECT_GT(slow["seconds"], quick["seconds"]);
    EXPECT_EQ(slow["store_in_memory_bytes"], 655360);
    // A store twice as large, with twice the samples and slots: the same in half of the units.
    ASSERT_EQ(run("t.trace --nodes 4 --links 1M --pool 20% --host-limit 50% --repeats 8 --samples 8000 --paths 128 --latency 0.00004 "
                  "--store 1310720 --report r2.json"),
              0)
        << file(".stderr");
    const auto twice = nlohmann::json::parse(file("r2.json"));
    EXPECT_EQ(twice["store_bytes"], 1310720);
    EXPECT_NEAR(twice["rows"][0]["seconds"].get<double>(), 2 * slow["seconds"].get<double>(), 1e-6);
}

TEST_F(CliBenchCluster, RefusesInOneLine) {
    const auto refused = [&](const std::string& arguments, int status, const std::string& named) {
        EXPECT_EQ(run(arguments), status) << arguments;
        const std::string errors = file(".stderr");
        EXPECT_EQ(std::count(errors.begin(), errors.end(), '\n'), 1) << errors;
        EXPECT_NE(errors.find(named), std::string::npos) << errors;
        EXPECT_EQ(file(".stdout"), "");
    };
    refused("", 2, "trace");
    refused("missing.trace", 1, "missing.trace");
    refused("none.trace", 1, "holds no paths");
    for (const char* wrong : {"--nodes 0", "--nodes 4097", "--links 0", "--pool 0", "--host-limit 101%", "--samples 0", "--repeats 0", "--latency x",
                              "--store 0", "--paths 0", "--disk -1"})
        refused(fmt::format("t.trace {}", wrong), 2, std::string(wrong).substr(0, std::string(wrong).find(' ')));
}

}  // namespace
}  // namespace raypager
