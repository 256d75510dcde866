// The report has exactly the keys that scripts read, and texts for people hold up to odd figures.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "cli/render_monitor.hpp"
#include "cli/report.hpp"

namespace raypager {
namespace {

using Keys = std::vector<std::string>;

Keys keys_of(const nlohmann::ordered_json& object) {
    Keys keys;
    for (const auto& [key, value] : object.items()) keys.push_back(key);
    return keys;
}

BakedScene small_scene() {
    BakedScene scene;
    scene.triangles = 90;
    scene.spheres = 10;
    scene.blocks.resize(2);
    scene.blocks[0].stored_bytes = 2048;
    scene.blocks[1].stored_bytes = 512;
    scene.blocks[0].wide_bytes = scene.blocks[1].wide_bytes = 3200;
    return scene;
}

RenderReport sample_report() {
    RenderReport report;
    report.limits = {1000, 640, 3000};
    report.peak = {900, 600, 2000};
    report.width = 8, report.height = 4, report.spp = 16;
    report.film_hash = 0xabc;
    report.seconds.render = 2;
    report.rays = {10, 20, 30};
    report.paging.loads = 4;
    return report;
}

TEST(CliReport, HasExactlyThePromisedKeys) {
    RenderSettings settings;
    settings.inputs = {"a.rpb"};
    settings.output = "out.exr";
    const auto json = report_json(settings, RenderOptions(), small_scene(), sample_report(), {5, 1});
    EXPECT_EQ(keys_of(json), (Keys{"raypager", "device", "scene", "limits", "peak", "image", "camera", "bounds", "seconds", "rays", "paging",
                                   "checkpoint", "settings"}));
    EXPECT_EQ(keys_of(json["device"]), (Keys{"name", "platform", "driver", "type"}));
    EXPECT_EQ(keys_of(json["scene"]),
              (Keys{"triangles", "spheres", "blocks", "block_bytes_max", "geometry_bytes", "stored_bytes", "bytes_per_primitive"}));
    for (const char* part : {"limits", "peak"}) EXPECT_EQ(keys_of(json[part]), (Keys{"memory_bytes", "geometry_bytes", "host_bytes"}));
    EXPECT_EQ(keys_of(json["image"]), (Keys{"width", "height", "spp", "average_spp", "complete", "film_hash"}));
    EXPECT_EQ(keys_of(json["seconds"]), (Keys{"total", "bake", "render", "trace", "stall", "kernel_build", "checkpoints", "stages"}));
    EXPECT_EQ(keys_of(json["checkpoint"]), (Keys{"runs", "written"}));
    EXPECT_EQ(keys_of(json["rays"]), (Keys{"camera", "bounce", "shadow", "total", "per_second"}));
    EXPECT_EQ(keys_of(json["paging"]), (Keys{"policy", "loads", "evictions", "bytes_loaded", "rounds", "wants_without_hit"}));
    for (const char* option :
         {"device",         "memory_limit", "geometry_limit",   "host_limit", "spp",       "time",      "size",         "max_depth",
          "seed",           "paths",        "policy",           "connection", "traversal", "camera",    "point_radius", "point_scale",
          "cull_to_camera", "cull_margin",  "filter_to_image",  "reference",  "log",       "snapshots", "report",       "cache_dir",
          "progress",       "checkpoint",   "checkpoint_every", "resume",     "tile",      "together",  "region"})
        EXPECT_TRUE(json["settings"].contains(option)) << option;
}

TEST(CliReport, FiguresAreThoseOfTheRender) {
    const auto json = report_json(RenderSettings(), RenderOptions(), small_scene(), sample_report(), {5, 1});
    EXPECT_EQ(json["scene"]["geometry_bytes"], 2560);
    EXPECT_EQ(json["scene"]["stored_bytes"], 2560);
    EXPECT_EQ(json["scene"]["block_bytes_max"], 2048);
    EXPECT_EQ(json["scene"]["bytes_per_primitive"], 25.6);
    EXPECT_EQ(json["image"]["film_hash"], "0000000000000abc");  // a number would lose bits in most readers
    EXPECT_EQ(json["rays"]["total"], 60);
    EXPECT_EQ(json["rays"]["per_second"], 30);
    EXPECT_EQ(json["seconds"]["bake"], 1);
    EXPECT_EQ(json["peak"]["memory_bytes"], 900);
}

// Bytes in memory are those of the form that blocks have on the device.
TEST(CliReport, OnACpuBlocksAreInTheWideForm) {
    RenderReport report = sample_report();
    report.form = BlockForm::wide;
    const auto json = report_json(RenderSettings(), RenderOptions(), small_scene(), report, {5, 1});
    EXPECT_EQ(json["scene"]["geometry_bytes"], 6400);
    EXPECT_EQ(json["scene"]["stored_bytes"], 2560);
    EXPECT_EQ(json["scene"]["block_bytes_max"], 3200);
    EXPECT_EQ(json["scene"]["bytes_per_primitive"], 64);
    EXPECT_EQ(json["settings"]["traversal"], "stream");
}

TEST(CliReport, NamesThatAreNoUtf8DoNotThrow) {
    RenderSettings settings;
    settings.output = "caf\xe9.exr";
    const std::string text = json_text(report_json(settings, RenderOptions(), small_scene(), sample_report(), {}));
    EXPECT_TRUE(nlohmann::json::accept(text));
}

TEST(CliReport, EmptySceneDividesByNothing) {
    const auto json = report_json(RenderSettings(), RenderOptions(), BakedScene(), RenderReport(), {});
    EXPECT_EQ(json["scene"]["bytes_per_primitive"], 0);
    EXPECT_EQ(json["rays"]["per_second"], 0);
    EXPECT_EQ(summary_text(BakedScene(), RenderReport(), {}).find("nan"), std::string::npos);
}

TEST(CliReport, ProgressFitsATerminalLine) {
    RenderProgress progress;
    progress.seconds = 40000;
    progress.spp = 12345.6;
    progress.fraction = 0.25;
    progress.rays_per_second = 1234.5e6;
    progress.loads = 1234567;
    progress.resident_bytes = uint64_t{700} << 20;
    progress.geometry_bytes = uint64_t{31} << 30;
    const std::string text = progress_text(progress, 65536);
    EXPECT_LT(text.size(), 120u) << text;
    for (const char* part : {"spp 12345.6/65536", "1234.50 Mrays/s", "700 MiB of 31.0 GiB", "1234567 loads", "33:20:00 left"})
        EXPECT_NE(text.find(part), std::string::npos) << text;
    EXPECT_TRUE(progress_text(progress, 0).starts_with("spp 12345.6 | ")) << progress_text(progress, 0);
}

}  // namespace
}  // namespace raypager
