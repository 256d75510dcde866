// Renders of parts of a picture, and forecasts from them: on the engine, and as users of the command line meet them.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>

#include "raypager/forecast.hpp"
#include "support/child_process.hpp"
#include "support/small_scene_file.hpp"
#include "support/test_options.hpp"

namespace raypager {
namespace {

using support::read_file;

class Forecasts : public support::SmallSceneFile {
protected:
    void SetUp() override {
        options_.width = 32, options_.height = 24, options_.spp = 64;
        options_.tuning.paths = 256;
        options_.geometry_limit_percent = 40;
    }

    MeasuredRender render_parts(const std::vector<SampleRange>& parts) const {
        support::TestOptions options = options_;
        options.spp = 8;
        if (!parts.empty()) options.instruments.parts = [&](const rp_render_params&) { return parts; };
        auto result = render(*file_, options, {});
        EXPECT_TRUE(result.ok()) << result.status().message();
        return result ? std::move(*result) : MeasuredRender();
    }

    support::TestOptions options_;
};

TEST_F(Forecasts, parts_that_are_all_of_a_render_make_its_picture) {
    const uint64_t samples = 32 * 24 * 8;
    const MeasuredRender whole = render_parts({});
    for (const uint64_t cut : {uint64_t{1}, uint64_t{700}, samples - 1}) {
        const MeasuredRender parts = render_parts({{0, cut}, {cut, samples}});
        EXPECT_EQ(parts.report.film_hash, whole.report.film_hash) << cut;
        EXPECT_TRUE(parts.report.complete);
    }
    std::vector<SampleRange> small;
    for (uint64_t begin = 0; begin < samples; begin += 512) small.push_back({begin, std::min(begin + 512, samples)});
    EXPECT_EQ(render_parts(small).report.film_hash, whole.report.film_hash);
}

TEST_F(Forecasts, parts_are_all_that_is_rendered) {
    const MeasuredRender parts = render_parts({{100, 150}, {1000, 1600}, {3000, 3001}});
    EXPECT_TRUE(parts.report.complete);
    EXPECT_EQ(parts.report.rays.camera, 651u);
    EXPECT_NEAR(parts.report.average_spp * 32 * 24, 651, 1e-6);
}

TEST_F(Forecasts, say_what_a_render_takes) {
    ForecastOptions how;
    how.seconds = 1e-3;  // once
    how.limits = {{0, 20}, {0, 40}, {0, 70}};
    const auto result = forecast(Blocks(file_), options_, how);
    ASSERT_TRUE(result.ok()) << result.status().message();
    EXPECT_EQ(result->samples, 32u * 24 * 64);
    EXPECT_LT(result->samples_measured, result->samples / 2);
    ASSERT_EQ(result->rows.size(), 4u);  // the limit that was asked for is not there twice
    for (size_t i = 1; i < result->rows.size(); i++) EXPECT_LT(result->rows[i].geometry_bytes, result->rows[i - 1].geometry_bytes);
    EXPECT_EQ(result->rows[0].geometry_bytes, result->scene_bytes);
    EXPECT_EQ(result->rows[0].slow_down, 1);
    EXPECT_EQ(result->rows[2].geometry_bytes, result->asked.geometry_bytes);
    for (const ForecastRow& row : result->rows) {
        EXPECT_TRUE(row.measured);
        EXPECT_GT(row.seconds, 0);
        EXPECT_EQ(row.paths, 256u);
    }
    EXPECT_GE(result->noise, 1);
    for (size_t i = 1; i < result->rows.size(); i++) EXPECT_LE(result->rows[i - 1].seconds, result->noise * result->rows[i].seconds * (1 + 1e-9));
    // All that is seen comes once, and nothing again.
    const auto bytes_of = [&](double percent) {
        options_.geometry_limit_percent = percent;
        return static_cast<double>(render(*file_, options_, {})->report.paging.bytes_loaded);
    };
    EXPECT_LE(result->resident.moved_bytes, static_cast<double>(result->scene_bytes));
    EXPECT_GE(result->resident.moved_bytes, 0.9 * bytes_of(100));
    // A quarter of the samples is measured, and loads depend on when others arrive: two renders differ by a third, beside other programs by a factor
    // of five.
    const std::array<double, 3> asked = {bytes_of(40), bytes_of(40), bytes_of(40)};
    EXPECT_GT(result->asked.moved_bytes, *std::ranges::min_element(asked) / 4);
    EXPECT_LT(result->asked.moved_bytes, *std::ranges::max_element(asked) * 4);
}

TEST_F(Forecasts, without_a_limit_nothing_is_slower) {
    options_.geometry_limit_percent = 0;
    options_.spp = 1;  // a whole render, and a short one
    ForecastOptions how;
    how.seconds = 1e-3;
    const auto result = forecast(Blocks(file_), options_, how);
    ASSERT_TRUE(result.ok()) << result.status().message();
    EXPECT_EQ(result->asked.slow_down, 1);
    EXPECT_EQ(result->asked.geometry_bytes, result->resident.geometry_bytes);
    EXPECT_EQ(result->samples_measured, result->samples);
    EXPECT_FALSE(result->halves_excess.has_value());
    EXPECT_FALSE(result->halves_time.has_value());
}

TEST_F(Forecasts, are_refused_as_the_render_is) {
    const auto same = [&](RenderOptions options) {
        const auto planned = forecast(Blocks(file_), options);
        const auto rendered = raypager::render(*file_, options, {});
        EXPECT_FALSE(planned.ok());
        EXPECT_FALSE(rendered.ok());
        EXPECT_EQ(planned.status().message(), rendered.status().message());
    };
    RenderOptions options = options_;
    options.memory_limit = 20000;
    same(options);
    options = options_;
    options.geometry_limit_percent = 0;
    options.geometry_limit = 10;
    same(options);
    options = options_;
    options.device = "no such device";
    same(options);
    options = options_;
    options.time_seconds = 3;
    EXPECT_FALSE(forecast(Blocks(file_), options).ok());
    options.time_seconds = 0;
    options.adaptive_error = 0.1;
    EXPECT_FALSE(forecast(Blocks(file_), options).ok());
}

TEST_F(Forecasts, end_when_they_are_stopped) {
    std::atomic<bool> stop{false};
    ForecastOptions how;
    how.stop = &stop;
    how.progress = [&](double) { stop = true; };
    const auto result = forecast(Blocks(file_), options_, how);
    ASSERT_FALSE(result.ok());
    EXPECT_EQ(result.status().kind(), ErrorKind::interrupted) << result.status().message();
}

class CliPlan : public testing::Test {
protected:
    void SetUp() override {
        std::ofstream(folder_ / "wedge.off")
            << "OFF\n5 6 0\n0 0 0\n2 0 0\n2 0 1\n0 0 1\n0.3 1.4 0.8\n3 0 1 2\n3 0 2 3\n3 0 4 1\n3 1 4 2\n3 2 4 3\n3 3 4 0\n";
    }
    int run(const std::string& arguments) const {
        const int raw = std::system(
            fmt::format("cd '{}' && timeout 120 '{}' plan >.stdout 2>.stderr </dev/null {}", folder_.string(), RAYPAGER_PROGRAM, arguments).c_str());
        return WIFEXITED(raw) ? WEXITSTATUS(raw) : -1;
    }
    std::string file(const char* name) const { return read_file(folder_ / name); }

    const support::TemporaryFolder temporary_;
    const std::filesystem::path folder_ = temporary_.path();
};

TEST_F(CliPlan, SaysSecondsAndBytes) {
    ASSERT_EQ(run("wedge.off --size 24x16 --spp 2 --effort 0.01 --background transparent --exposure 1 --report r.json"), 0) << file(".stderr");
    EXPECT_NE(file(".stdout").find("24x16, 2 spp on "), std::string::npos) << file(".stdout");
    EXPECT_NE(file(".stdout").find("> "), std::string::npos) << "the row that was asked for";
    const auto report = nlohmann::json::parse(file("r.json"), nullptr, false);
    ASSERT_TRUE(report.is_object());
    EXPECT_EQ(report["samples"], 24 * 16 * 2);
    EXPECT_EQ(report["asked"], report["resident"]);
    EXPECT_EQ(report["asked"]["slow_down"], 1.0);
    EXPECT_EQ(report["halves_excess_bytes"], nullptr);
    EXPECT_FALSE(std::filesystem::exists(folder_ / "a.pfm"));
}

// Layers are words of the film, and of path slots, which there must be room for.
TEST_F(CliPlan, CountsTheMemoryOfLayers) {
    const std::string render = "wedge.off --size 64x64 --spp 1 --paths 1024 --effort 0.01 --report r.json ";
    const auto memory = [&](const std::string& more) {
        EXPECT_EQ(run(render + more), 0) << file(".stderr");
        const auto report = nlohmann::json::parse(file("r.json"), nullptr, false);
        return report.is_object() ? report["asked"]["memory_bytes"].get<uint64_t>() : 0;
    };
    constexpr uint64_t pixels = 64 * 64;
    setenv("RAYPAGER_OIDN", RAYPAGER_FAKE_OIDN_2, 1);
    const uint64_t plain = memory(""), denoised = memory("--denoise"), layered = memory("--layers albedo,normal"), all = memory("--layers all");
    unsetenv("RAYPAGER_OIDN");
    EXPECT_GE(denoised, plain + 52 * pixels) << "as its help says";
    EXPECT_EQ(denoised, layered);
    EXPECT_GT(all, layered);
    EXPECT_EQ(nlohmann::json::parse(file("r.json"))["layers"].get<std::string>().find("albedo"), 0u);
    // What has room as a whole without layers is in parts with them, and in the end refused, as it would be for the render.
    const std::string limit = fmt::format("--memory-limit {} ", (plain + layered) / 2);
    EXPECT_EQ(run(render + limit), 0) << file(".stderr");
    EXPECT_EQ(file(".stderr").find("in parts"), std::string::npos) << file(".stderr");
    EXPECT_EQ(run(render + limit + "--layers albedo,normal"), 0) << file(".stderr");
    EXPECT_NE(file(".stderr").find("the film is on the device in parts"), std::string::npos) << file(".stderr");
    EXPECT_EQ(run(render + "--memory-limit 100K --layers albedo,normal"), 1);
    EXPECT_NE(file(".stderr").find("the smallest that would do is"), std::string::npos) << file(".stderr");
}

TEST_F(CliPlan, RefusesInOneLine) {
    const auto refused = [&](const std::string& arguments, int status, const std::string& named) {
        EXPECT_EQ(run(arguments), status) << arguments;
        std::string errors = file(".stderr");
        if (errors.starts_with("raypager: the scene is baked already")) errors.erase(0, errors.find('\n') + 1);
        EXPECT_EQ(std::count(errors.begin(), errors.end(), '\n'), 1) << errors;
        EXPECT_NE(errors.find(named), std::string::npos) << errors;
        EXPECT_EQ(file(".stdout"), "");
    };
    refused("", 2, "INPUT");
    refused("wedge.off --time 3", 2, "--time");
    refused("wedge.off --limits 50%,0", 2, "--limits");
    refused("wedge.off --effort 0", 2, "--effort");
    refused("wedge.off --memory-limit 1M --geometry-limit 2M", 2, "--geometry-limit");
    refused("wedge.off --layers albedo,colour", 2, "--layers");
    refused("wedge.off --report wedge.off", 2, "same file");
    refused("none.off", 1, "none.off");
    setenv("RAYPAGER_OIDN", "none.so", 1);
    refused("wedge.off --denoise", 1, "--denoise");
    unsetenv("RAYPAGER_OIDN");
    ASSERT_EQ(run("wedge.off --size 24x16 --spp 1 --effort 0.01"), 0);
    refused("wedge.off --size 24x16 --memory-limit 4K", 1, "the smallest that would do is");
    refused("wedge.off --size 24x16 --geometry-limit 1", 1, "give at least that");
    refused("wedge.off --size 24x16 --limits 1", 1, "give at least that");
    refused("wedge.off --size 24x16 --report no/folder/r.json", 1, "no/folder");
}

// Of several machines, too, where it is asked for.
TEST_F(CliPlan, SaysWhatMachinesTogetherTake) {
    const std::string render = "wedge.off --size 48x32 --spp 8 --effort 0.01 --report r.json ";
    ASSERT_EQ(run(render), 0) << file(".stderr");
    EXPECT_FALSE(nlohmann::json::parse(file("r.json")).contains("cluster"));
    EXPECT_EQ(file(".stdout").find("nodes"), std::string::npos);
    ASSERT_EQ(run(render + "--nodes 2,4 --link 1G --host-limit 64M"), 0) << file(".stderr");
    EXPECT_NE(file(".stdout").find("machines with a link of 1.00 GiB/s each"), std::string::npos) << file(".stdout");
    const auto cluster = nlohmann::json::parse(file("r.json"))["cluster"];
    EXPECT_EQ(cluster["link_bytes_per_second"], double(1 << 30));
    EXPECT_EQ(cluster["recorded_paths"], 48 * 32 * 8);
    ASSERT_EQ(cluster["rows"].size(), 3u);
    const uint32_t nodes[] = {1, 2, 4};
    for (size_t i = 0; i < 3; i++) {
        const auto& row = cluster["rows"][i];
        EXPECT_EQ(row["nodes"], nodes[i]);
        EXPECT_GT(row["seconds"], 0.0);
        EXPECT_GT(row["efficiency"], 0.0);
        EXPECT_LE(row["efficiency"], 1.001);
        EXPECT_EQ(row["host_limit"], 64 << 20);
        EXPECT_EQ(row["store_in_memory_bytes"], cluster["store_bytes"]);
        EXPECT_EQ(row["bytes_from_disk"], 0);
    }
    EXPECT_EQ(cluster["rows"][0]["bytes_received"], 0);
    // There is one block: one node has it.
    EXPECT_GT(cluster["rows"][1]["bytes_received"], 0);
}

TEST_F(CliPlan, RefusesMachinesInOneLine) {
    const auto refused = [&](const std::string& arguments, int status, const std::string& named) {
        EXPECT_EQ(run(arguments), status) << arguments;
        const std::string errors = file(".stderr");
        EXPECT_EQ(std::count(errors.begin(), errors.end(), '\n'), 1) << errors;
        EXPECT_NE(errors.find(named), std::string::npos) << errors;
        EXPECT_EQ(file(".stdout"), "");
    };
    for (const char* nodes : {"0", "4097", "-1", "2,x", "\"\"", "1.5"}) refused(fmt::format("wedge.off --nodes {}", nodes), 2, "--nodes");
    refused("wedge.off --link 1G", 2, "--nodes");
    refused("wedge.off --nodes 2 --link 0", 2, "--link");
    refused("wedge.off --nodes 2 --link fast", 2, "--link");
    // A grid of 200 triangles that is placed twice.
    std::ofstream scene(folder_ / "twice.pbrt");
    scene << "WorldBegin\nLightSource \"infinite\"\nObjectBegin \"grid\"\nShape \"trianglemesh\" \"point3 P\" [";
    for (int i = 0; i < 121; i++) scene << i % 11 << " " << i / 11 << " " << i % 3 << " ";
    scene << "] \"integer indices\" [";
    for (int i = 0; i < 100; i++) {
        const int at = i / 10 * 11 + i % 10;
        scene << fmt::format("{} {} {} {} {} {} ", at, at + 1, at + 12, at, at + 12, at + 11);
    }
    scene << "]\nObjectEnd\nObjectInstance \"grid\"\nTranslate 20 0 0\nObjectInstance \"grid\"\n";
    scene.close();
    ASSERT_EQ(run("twice.pbrt --size 16x16 --spp 1 --effort 0.01"), 0) << file(".stderr");
    EXPECT_EQ(run("twice.pbrt --size 16x16 --spp 1 --nodes 2"), 2);
    EXPECT_NE(file(".stderr").find("--nodes"), std::string::npos) << file(".stderr");
}

TEST_F(CliPlan, StopsAtASignal) {
    support::ChildProcess child(RAYPAGER_PROGRAM, {"plan", "wedge.off", "--size", "256x256", "--spp", "4096", "--paths", "500000", "--progress"},
                                folder_);
    while (file("stderr").find("measuring") == std::string::npos) {
        support::ChildResult early;
        ASSERT_FALSE(child.wait(0.05, early)) << file("stderr");
    }
    child.signal(SIGINT);
    support::ChildResult result;
    ASSERT_TRUE(child.wait(support::patience, result));
    EXPECT_EQ(result.exit_code, 3) << file("stderr");
    EXPECT_EQ(file("stdout"), "");
}

}  // namespace
}  // namespace raypager
