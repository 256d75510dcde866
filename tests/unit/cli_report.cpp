// The report has exactly the keys that scripts read, and texts for people hold up to odd figures.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "base/log.hpp"
#include "base/words.hpp"
#include "cli/render_monitor.hpp"
#include "cli/report.hpp"
#include "support/scene_only.hpp"

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
    const auto json = report_json(settings, RenderOptions(), support::blocks_of(small_scene()), sample_report(), {5, 1});
    EXPECT_EQ(keys_of(json), (Keys{"raypager", "device", "devices", "ranks", "scene", "limits", "peak", "image", "layers", "camera", "bounds",
                                   "seconds", "rays", "paging", "checkpoint", "settings"}));
    EXPECT_EQ(keys_of(json["device"]), (Keys{"name", "platform", "driver", "type"}));
    EXPECT_EQ(keys_of(json["scene"]), (Keys{"triangles", "spheres", "blocks", "block_bytes_max", "geometry_bytes", "stored_bytes",
                                            "bytes_per_primitive", "images", "pages", "texture_bytes"}));
    for (const char* part : {"limits", "peak"}) EXPECT_EQ(keys_of(json[part]), (Keys{"memory_bytes", "geometry_bytes", "host_bytes"}));
    EXPECT_EQ(keys_of(json["image"]), (Keys{"width", "height", "spp", "average_spp", "complete", "film_hash"}));
    EXPECT_EQ(keys_of(json["seconds"]), (Keys{"total", "bake", "denoise", "render", "trace", "stall", "kernel_build", "checkpoints", "stages"}));
    EXPECT_EQ(keys_of(json["checkpoint"]), (Keys{"runs", "written"}));
    EXPECT_EQ(keys_of(json["rays"]), (Keys{"camera", "bounce", "shadow", "total", "per_second"}));
    EXPECT_EQ(keys_of(json["paging"]), (Keys{"policy", "loads", "evictions", "bytes_loaded", "rounds", "wants_without_hit", "texture_waits"}));
    for (const char* option :
         {"device",         "memory_limit", "geometry_limit",   "host_limit", "spp",       "time",      "size",         "max_depth",
          "seed",           "paths",        "policy",           "connection", "traversal", "camera",    "point_radius", "point_scale",
          "cull_to_camera", "cull_margin",  "filter_to_image",  "reference",  "log",       "snapshots", "report",       "cache_dir",
          "progress",       "checkpoint",   "checkpoint_every", "resume",     "tile",      "together",  "region",       "tune",
          "layers",         "denoise"})
        EXPECT_TRUE(json["settings"].contains(option)) << option;
}

TEST(CliReport, FiguresAreThoseOfTheRender) {
    const auto json = report_json(RenderSettings(), RenderOptions(), support::blocks_of(small_scene()), sample_report(), {5, 1});
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
    const auto json = report_json(RenderSettings(), RenderOptions(), support::blocks_of(small_scene()), report, {5, 1});
    EXPECT_EQ(json["scene"]["geometry_bytes"], 6400);
    EXPECT_EQ(json["scene"]["stored_bytes"], 2560);
    EXPECT_EQ(json["scene"]["block_bytes_max"], 3200);
    EXPECT_EQ(json["scene"]["bytes_per_primitive"], 64);
    EXPECT_EQ(json["settings"]["traversal"], "stream");
}

TEST(CliReport, NamesThatAreNoUtf8DoNotThrow) {
    RenderSettings settings;
    settings.output = "caf\xe9.exr";
    const std::string text = json_text(report_json(settings, RenderOptions(), support::blocks_of(small_scene()), sample_report(), {}));
    EXPECT_TRUE(nlohmann::json::accept(text));
}

TEST(CliReport, EmptySceneDividesByNothing) {
    const auto json = report_json(RenderSettings(), RenderOptions(), support::blocks_of({}), RenderReport(), {});
    EXPECT_EQ(json["scene"]["bytes_per_primitive"], 0);
    EXPECT_EQ(json["rays"]["per_second"], 0);
    EXPECT_EQ(summary_text(support::blocks_of({}), RenderReport(), {}).find("nan"), std::string::npos);
}

TEST(CliReport, ProgressFitsSixtyColumns) {
    RenderProgress progress;
    progress.seconds = 40;
    progress.spp = 12.34;
    progress.fraction = 0.25;
    progress.rays_per_second = 12.34e6;
    progress.loads = 1;
    EXPECT_EQ(progress_text(progress, 64), "spp 12.3/64 | 12.3 Mrays/s | 1 load | 2:00 left");
    progress.resident_bytes = 1;
    progress.geometry_bytes = 4;
    progress.loads = 1234567;
    EXPECT_EQ(progress_text(progress, 64), "spp 12.3/64 | 12.3 Mrays/s | 25 % resident | 2:00 left") << "what matters least goes first";
    progress.seconds = 4e8;
    progress.spp = 12345.6;
    progress.rays_per_second = 123456e6;
    const std::string text = progress_text(progress, 65535);
    EXPECT_LE(text.size(), progress_columns) << text;
    for (const char* part : {"spp 12345.6/65535", " left"}) EXPECT_NE(text.find(part), std::string::npos) << text;
    EXPECT_TRUE(progress_text(progress, 0).starts_with("spp 12345.6 | ")) << progress_text(progress, 0);
}

TEST(CliReport, ProgressSaysWhoTakesTheSamples) {
    RenderProgress progress;
    progress.spp = 1;
    progress.devices = {{0, 0, 1, 0, 0, 0}, {0, 1, 2, 0, 0, 0}};
    EXPECT_EQ(progress_text(progress, 4), "spp 1.0/4 | 0.00 Mrays/s | 0: 33 %, 1: 67 % | 0 loads");
    progress.devices[1] = {1, 0, 1, 0, 0, 0};
    progress.devices.push_back({1, 1, 2, 0, 0, 0});
    EXPECT_EQ(progress_text(progress, 4), "spp 1.0/4 | 0.00 Mrays/s | rank 0: 25 %, 1: 75 % | 0 loads");
}

TEST(CliReport, CountsThingsAsPeopleDo) {
    EXPECT_EQ(primitives_text(0, 0), "0 triangles");
    EXPECT_EQ(primitives_text(1, 0), "1 triangle");
    EXPECT_EQ(primitives_text(99, 0, 98), "99 triangles (98 of them ground)");
    EXPECT_EQ(primitives_text(0, 1), "1 sphere or point");
    EXPECT_EQ(primitives_text(98, 1234, 98), "98 triangles (98 of them ground) and 1,234 spheres and points");
    EXPECT_EQ(counted(2, "box", "boxes"), "2 boxes");
    EXPECT_EQ(format_bytes(0), "0 bytes");
    EXPECT_EQ(format_bytes(1), "1 byte");
    EXPECT_EQ(format_bytes(7340032), "7.00 MiB");
    EXPECT_EQ(format_exact_bytes(7340032), "7340032 bytes (7.00 MiB)");
    EXPECT_EQ(format_share(0), "0.0 %");
    EXPECT_EQ(format_share(1e-6), "less than 0.1 %");
    EXPECT_EQ(format_share(0.9999), "more than 99.9 %");
    EXPECT_EQ(format_share(0.123), "12.3 %");
    EXPECT_EQ(shortened("abcdefgh", 8), "abcdefgh");
    EXPECT_EQ(shortened("abcdefghi", 8), "abcde...");
}

// What is paged are blocks and pages; only scenes with images say so.
TEST(CliReport, ImagesCountAsThatWhatIsPaged) {
    BakedScene scene = small_scene();
    EXPECT_EQ(summary_text(support::blocks_of(scene), sample_report(), {}).find("images"), std::string::npos);
    scene.images.resize(3);
    scene.pages.resize(2);
    RenderReport report = sample_report();
    report.limits.geometry_bytes = 2560 + 65536;
    report.paging.bytes_loaded = 2 * (2560 + 131072);
    const std::string text = summary_text(support::blocks_of(scene), report, {});
    for (const char* part : {"images           3 in 2 pages, 128 KiB", "51.0 % of the scene", "2.0 times the scene", "4 blocks and pages, 0 evicted"})
        EXPECT_NE(text.find(part), std::string::npos) << part << "\n" << text;
    EXPECT_EQ(scene_json(support::blocks_of(scene), BlockForm::stored)["texture_bytes"], 131072);
}

// The same figure is the same everywhere: times the scene in bytes, to one decimal.
TEST(CliReport, SaysHowOftenTheSceneWentThroughThePool) {
    RenderReport report = sample_report();
    report.paging.bytes_loaded = 14464;  // 5.65 times 2560
    report.complete = false;
    report.average_spp = 3.96;
    const std::string text = summary_text(support::blocks_of(small_scene()), report, {});
    EXPECT_NE(text.find("5.7 times the scene"), std::string::npos) << text;
    EXPECT_NE(text.find("4.0 spp"), std::string::npos) << "of a render that was stopped, the average: " << text;
    for (size_t begin = 0; begin < text.size();) {
        const size_t end = text.find('\n', begin);
        EXPECT_LE(end - begin, 80u) << text.substr(begin, end - begin);
        begin = end + 1;
    }
}

}  // namespace
}  // namespace raypager
