// The options of a verb as a whole: what is taken, and what is refused as bad usage with the option's name.
#include <gtest/gtest.h>

#include <cmath>

#include "cli/look_options.hpp"
#include "cli/option_parser.hpp"
#include "cli/render_settings.hpp"
#include "cli/turntable.hpp"
#include "support/scene_only.hpp"

namespace raypager {
namespace {

RenderSettings parsed(const Arguments& arguments) {
    const auto settings = parse_render_settings(arguments);
    EXPECT_TRUE(settings.ok()) << settings.status().message();
    if (!settings || !*settings) return {};
    return **settings;
}

// named: what the message must contain so that the user knows where to look.
void expect_refused(const Arguments& arguments, const std::string& named) {
    const auto settings = parse_render_settings(arguments);
    ASSERT_FALSE(settings.ok()) << "was taken; expected an error about " << named;
    EXPECT_EQ(settings.status().exit_code(), 2);
    const std::string& message = settings.status().message();
    EXPECT_TRUE(message.starts_with("render: ")) << message;
    EXPECT_NE(message.find(named), std::string::npos) << message;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
}

TEST(CliOptions, RenderDefaultsLeaveTheChoiceToSceneAndDevice) {
    const RenderSettings settings = parsed({"a.rpb", "-o", "a.pfm"});
    EXPECT_EQ(settings.inputs, std::vector<std::filesystem::path>{"a.rpb"});
    EXPECT_EQ(settings.output, "a.pfm");
    EXPECT_EQ(settings.options.device, "");
    EXPECT_EQ(settings.options.memory_limit, 0u);
    EXPECT_EQ(settings.options.geometry_limit, 0u);
    EXPECT_EQ(settings.options.geometry_limit_percent, 0);
    EXPECT_EQ(settings.options.spp, 0u);
    EXPECT_FALSE(settings.options.max_depth);
    EXPECT_EQ(settings.options.tuning.policy, PolicyKind::aged_wants);
    EXPECT_EQ(settings.options.connection, Connection::queue);
    EXPECT_FALSE(settings.camera);
    EXPECT_FALSE(settings.progress);
}

TEST(CliOptions, PointsCanBeChangedWhenTheyAreBaked) {
    EXPECT_EQ(parsed({"a.las", "-o", "a.pfm"}).bake.points.radius, 0);
    EXPECT_EQ(parsed({"a.las", "-o", "a.pfm", "--point-radius", "0.25"}).bake.points.radius, 0.25f);
    const PointOptions points = parsed({"a.las", "-o", "a.pfm", "--point-radius", "auto", "--point-scale", "1.5", "--cull-to-camera", "--cull-margin",
                                        "0", "--filter-to-image"})
                                    .bake.points;
    EXPECT_EQ(points.radius, 0);
    EXPECT_TRUE(points.radius_from_spacing);
    EXPECT_EQ(points.radius_scale, 1.5f);
    EXPECT_TRUE(points.cull_to_camera);
    EXPECT_EQ(points.cull_margin, 0);
    EXPECT_TRUE(points.filter_to_image);
    for (const char* value : {"0", "-1", "1e99", "nan", "big"}) expect_refused({"a.las", "-o", "a.pfm", "--point-radius", value}, "--point-radius");
    expect_refused({"a.las", "-o", "a.pfm", "--point-scale", "0"}, "--point-scale");
    expect_refused({"a.las", "-o", "a.pfm", "--cull-margin", "-0.1"}, "--cull-margin");
    expect_refused({"a.rpb", "-o", "a.pfm", "--cull-to-camera"}, "a.rpb");
}

TEST(CliOptions, RenderTakesEveryOption) {
    const RenderSettings settings = parsed({"a.ply",
                                            "b.obj",
                                            "--output=out.exr",
                                            "--device",
                                            "1",
                                            "--memory-limit",
                                            "2G",
                                            "--geometry-limit",
                                            "12.5%",
                                            "--host-limit",
                                            "4G",
                                            "--spp",
                                            "128",
                                            "--time",
                                            "90",
                                            "--size",
                                            "640x480",
                                            "--max-depth",
                                            "0",
                                            "--seed",
                                            "7",
                                            "--paths",
                                            "1M",
                                            "--policy",
                                            "most-wanted",
                                            "--connection",
                                            "roulette",
                                            "--camera",
                                            "-1,2,3,0,0,0,0,1,0,35",
                                            "--reference",
                                            "ref.exr",
                                            "--log",
                                            "log.csv",
                                            "--snapshots",
                                            "2.5",
                                            "--report",
                                            "report.json",
                                            "--cache-dir",
                                            "cache",
                                            "--progress"});
    EXPECT_EQ(settings.inputs.size(), 2u);
    EXPECT_EQ(settings.output, "out.exr");
    EXPECT_EQ(settings.options.device, "1");
    EXPECT_EQ(settings.options.memory_limit, uint64_t{2} << 30);
    EXPECT_EQ(settings.options.geometry_limit_percent, 12.5);
    EXPECT_EQ(settings.options.host_limit, uint64_t{4} << 30);
    EXPECT_EQ(settings.options.spp, 128u);
    EXPECT_EQ(settings.options.time_seconds, 90);
    EXPECT_EQ(settings.options.width, 640u);
    EXPECT_EQ(settings.options.height, 480u);
    EXPECT_EQ(settings.options.max_depth, std::optional<uint32_t>(0));
    EXPECT_EQ(settings.options.seed, 7u);
    EXPECT_EQ(settings.options.tuning.paths, 1000000u);
    EXPECT_EQ(settings.options.tuning.policy, PolicyKind::most_wanted);
    EXPECT_EQ(settings.options.connection, Connection::roulette);
    ASSERT_TRUE(settings.camera);
    EXPECT_EQ(settings.camera->eye.x, -1);
    EXPECT_EQ(settings.reference, std::filesystem::path("ref.exr"));
    EXPECT_EQ(settings.log, std::filesystem::path("log.csv"));
    EXPECT_EQ(settings.snapshot_seconds, 2.5);
    EXPECT_EQ(settings.report, std::filesystem::path("report.json"));
    EXPECT_EQ(settings.cache_directory, std::filesystem::path("cache"));
    EXPECT_TRUE(settings.progress);
}

TEST(CliOptions, WrongValuesNameTheirOption) {
    const auto with = [](const std::string& option, const std::string& value) { return Arguments{"a.rpb", "-o", "a.pfm", option, value}; };
    expect_refused(with("--spp", "0"), "--spp: '0'");
    expect_refused(with("--spp", "-3"), "--spp");
    expect_refused(with("--spp", "many"), "--spp: 'many'");
    expect_refused(with("--size", "0x0"), "--size: '0x0'");
    expect_refused(with("--memory-limit", "-1G"), "--memory-limit");
    expect_refused(with("--memory-limit", "50%"), "--memory-limit: '50%'");
    expect_refused(with("--geometry-limit", "0%"), "--geometry-limit: '0%'");
    expect_refused(with("--host-limit", "big"), "--host-limit: 'big'");
    expect_refused(with("--time", "0"), "--time: '0'");
    expect_refused(with("--max-depth", "1.5"), "--max-depth: '1.5'");
    expect_refused(with("--seed", "4294967296"), "--seed: '4294967296'");
    expect_refused(with("--paths", "0"), "--paths: '0'");
    expect_refused(with("--policy", "best"), "--policy: 'best'");
    expect_refused(with("--connection", "both"), "--connection: 'both'");
    expect_refused(with("--camera", "1,2,3"), "--camera: '1,2,3'");
    expect_refused(with("--snapshots", "-1"), "--snapshots");
    expect_refused(with("--device", ""), "--device");
    expect_refused(with("--log", ""), "--log");
    expect_refused(with("--sp", "4"), "--sp");  // no abbreviations
}

TEST(CliOptions, WrongCombinationsAreRefused) {
    expect_refused({}, "INPUT is missing");
    expect_refused({"-o", "a.pfm"}, "INPUT is missing");
    expect_refused({"a.rpb"}, "-o is missing");
    expect_refused({"a.rpb", "-o"}, "output");
    expect_refused({"a.rpb", "-o", "a.pfm", "--spp", "1", "--spp", "2"}, "--spp: is given more than once");
    expect_refused({"a.rpb", "-o", "a.pfm", "--nonsense"}, "--nonsense");
    expect_refused({"a.rpb", "-o", "a.pfm", "--progress=yes"}, "--progress");
    expect_refused({"a.rpb", "b.rpb", "-o", "a.pfm"}, "'a.rpb' is a block file");
    expect_refused({"a.rpb", "-o", "a.pfm", "--memory-limit", "1G", "--geometry-limit", "2G"}, "--geometry-limit");
    expect_refused({"a.rpb", "-o", "x", "--log", "x"}, "-o and --log are the same file");
    expect_refused({"a.rpb", "-o", "a.pfm", "--reference", "./a.pfm"}, "--reference and -o are the same file");
    expect_refused({"a.rpb", "-o", "a.pfm", "--report", "a.rpb"}, "INPUT and --report are the same file");
}

// Colours are linear, or sRGB where they are hexadecimal.
TEST(CliLook, Colors) {
    EXPECT_EQ(*parse_color("0.5,0,12"), (Float3{0.5f, 0, 12}));
    const Float3 hex = *parse_color("#ff8000");
    EXPECT_EQ(hex.x, 1);
    EXPECT_NEAR(hex.y, 0.2158605, 1e-6);
    EXPECT_EQ(hex.z, 0);
    for (const char* text : {"", "1", "1,2", "1,2,3,4", "-1,0,0", "nan,0,0", "#fff", "#ff80000", "#gg0000", "red", "1,2,3 "})
        EXPECT_FALSE(parse_color(text).ok()) << text;
}

TEST(CliLook, Materials) {
    const auto kind = [](const char* text) {
        const auto material = parse_material(text);
        EXPECT_TRUE(material.ok()) << text;
        return material ? material->kind : RP_NONE;
    };
    for (const char* text : {"clay", "white", "grey", "gray", "black", "diffuse:0.1,0.2,0.3", "diffuse:#336699"})
        EXPECT_EQ(kind(text), RP_MATERIAL_DIFFUSE) << text;
    for (const char* text : {"gold", "silver", "copper", "brass", "aluminium", "aluminum", "chrome", "mirror", "metal:gold", "metal:chrome,0.3",
                             "metal:0.9,0.5,0.2", "metal:0.9,0.5,0.2,0", "metal:#ffcc00,1"})
        EXPECT_EQ(kind(text), RP_MATERIAL_CONDUCTOR) << text;
    EXPECT_EQ(kind("glass"), RP_MATERIAL_DIELECTRIC);
    EXPECT_EQ(parse_material("glass")->ior, 1.5f);
    EXPECT_EQ(parse_material("glass:1.33")->ior, 1.33f);
    EXPECT_EQ(parse_material("diffuse:0.1,0.2,0.3")->color[2], 0.3f);
    EXPECT_EQ(parse_material("mirror")->alpha, 0);
    EXPECT_EQ(parse_material("chrome")->alpha, 0);
    EXPECT_EQ(parse_material("gold")->alpha, 0.1f);
    EXPECT_EQ(parse_material("metal:gold,0.25")->alpha, 0.25f);
    EXPECT_EQ(parse_material("plastic:0.1,0.2,0.3,0.4")->alpha, 0.4f);
    EXPECT_TRUE(parse_material("plastic:#ff8000")->flags & RP_MATERIAL_COAT);
    // k follows from the reflectance at right angles: ((k^2) / (k^2 + 4)).
    const float k = parse_material("metal:0.5,0.5,0.5,0")->k[0];
    EXPECT_NEAR(k * k / (k * k + 4), 0.5, 1e-5);
    EXPECT_TRUE(parse_material("clay")->flags & RP_MATERIAL_PLAIN) << "it counts instead of colours that the file has";
    for (const char* text : {"", "wood", "diffuse", "diffuse:", "diffuse:1,1", "diffuse:2,0,0", "metal", "metal:", "metal:wood", "metal:gold,2",
                             "gold,0.2", "metal:1,2", "glass:", "glass:0.5", "glass:water", "mirror:1", "clay:1", "metal:gold,0.1,0.2"}) {
        const auto material = parse_material(text);
        ASSERT_FALSE(material.ok()) << text;
        EXPECT_NE(material.status().message().find("metal:NAME"), std::string::npos);
    }
}

TEST(CliLook, SkiesAndLights) {
    EXPECT_EQ(*parse_sky("none"), (Float3{0, 0, 0}));
    EXPECT_EQ(*parse_sky("0.1,0.2,0.3"), (Float3{0.1f, 0.2f, 0.3f}));
    for (const char* file : {"sky.exr", "a/b.hdr"})
        EXPECT_NE(parse_sky(file).status().message().find("cannot be pictures yet"), std::string::npos) << file;
    for (const char* text : {"", "blue", "0.1,0.2", "-1,0,0"})
        EXPECT_NE(parse_sky(text).status().message().find("is not a sky"), std::string::npos) << text;

    using Kind = BareLight::Kind;
    EXPECT_EQ(parse_light("none")->kind, Kind::none);
    EXPECT_EQ(parse_light("key")->kind, Kind::key);
    EXPECT_EQ(parse_light("key")->strength, 1);
    EXPECT_EQ(parse_light("key:0.5")->strength, 0.5);
    EXPECT_EQ(parse_light("sun")->kind, Kind::sun);
    EXPECT_FALSE(parse_light("sun")->place);
    EXPECT_EQ(parse_light("sun:-45,30")->place->azimuth, -45);
    EXPECT_EQ(parse_light("sun:-45,30")->place->elevation, 30);
    EXPECT_EQ(parse_light("sun:-45,30,4")->strength, 4);
    for (const char* text : {"", "moon", "none:1", "key:", "key:0", "key:-1", "key:1,2", "sun:", "sun:10", "sun:10,91", "sun:10,-1", "sun:10,20,0",
                             "sun:10,20,1,1", "sun:400,0"})
        EXPECT_NE(parse_light(text).status().message().find("is not a light"), std::string::npos) << text;
}

TEST(CliLook, OptionsOfARender) {
    const RenderSettings settings = parsed({"a.ply", "-o", "a.exr", "--material", "gold", "--sky", "none", "--light", "sun:10,20", "--no-ground",
                                            "--background", "transparent", "--exposure", "-1.5", "--turntable", "8"});
    ASSERT_TRUE(settings.look.material);
    EXPECT_EQ(settings.look.sky, (Float3{0, 0, 0}));
    EXPECT_EQ(settings.look.light.place->azimuth, 10);
    EXPECT_TRUE(settings.look.no_ground);
    ASSERT_TRUE(settings.options.background);
    EXPECT_TRUE(settings.options.background->transparent);
    EXPECT_EQ(settings.exposure, -1.5);
    EXPECT_EQ(settings.turntable, 8u);
    EXPECT_EQ(settings.texts.material, "gold");
    EXPECT_EQ(parsed({"a.rpb", "-o", "a.pfm", "--background", "1,0.5,0"}).options.background->color, (Float3{1, 0.5f, 0}));
}

TEST(CliLook, WhatDoesNotGoTogetherIsRefused) {
    for (const std::string input : {"a.rpb", "a.pbrt", "a.PBRT.gz"})
        for (const Arguments& option : {Arguments{"--material", "gold"}, {"--sky", "none"}, {"--light", "key"}, {"--no-ground"}}) {
            Arguments arguments = {input, "-o", "a.pfm"};
            arguments.insert(arguments.end(), option.begin(), option.end());
            expect_refused(arguments, option[0] + ": is for bare meshes and point clouds; '" + input + "'");
        }
    // Files of glTF have materials, but not always lights.
    expect_refused({"a.glb", "-o", "a.pfm", "--material", "gold"}, "--material: is for bare meshes and point clouds; 'a.glb'");
    EXPECT_EQ(parsed({"a.glb", "-o", "a.pfm", "--sky", "none", "--light", "key", "--no-ground"}).look.sky, (Float3{0, 0, 0}));
    expect_refused({"a.rpb", "-o", "a.pfm", "--background", "transparent"}, "--background transparent: 'a.pfm'");
    expect_refused({"a.rpb", "-o", "a.pfm", "--background", "blue"}, "--background: 'blue'");
    expect_refused({"a.rpb", "-o", "a.pfm", "--exposure", "bright"}, "--exposure: 'bright'");
    expect_refused({"a.rpb", "-o", "a.pfm", "--exposure", "100"}, "--exposure");
    expect_refused({"a.rpb", "-o", "a.pfm", "--turntable", "0"}, "--turntable");
    expect_refused({"a.rpb", "-o", "a.pfm", "--turntable", "4", "--checkpoint", "c"}, "--turntable: --checkpoint");
    expect_refused({"a.rpb", "-o", "a.pfm", "--turntable", "4", "--reference", "r.pfm"}, "--turntable: --reference");
}

TEST(CliLook, TurntablesNumberTheirPictures) {
    EXPECT_EQ(turntable_picture("out/bust.png", 7, 36), "out/bust_007.png");
    EXPECT_EQ(turntable_picture("bust.v2.exr", 999, 1000), "bust.v2_999.exr");
    EXPECT_EQ(turntable_picture("bust.exr", 12, 1200), "bust_0012.exr");
}

TEST(CliOptions, HelpComesBeforeComplaints) {
    testing::internal::CaptureStdout();
    const auto settings = parse_render_settings({"--help"});
    const std::string help = testing::internal::GetCapturedStdout();
    ASSERT_TRUE(settings.ok());
    EXPECT_FALSE(settings->has_value());
    for (const char* option : {"--output",    "--device",    "--memory-limit", "--geometry-limit", "--host-limit", "--spp",        "--time",
                               "--size",      "--max-depth", "--seed",         "--paths",          "--policy",     "--connection", "--camera",
                               "--reference", "--log",       "--snapshots",    "--report",         "--cache-dir",  "--progress",   "--help"})
        EXPECT_NE(help.find(option), std::string::npos) << option << " is missing in:\n" << help;
}

TEST(CliOptions, ListsInHelpKeepTheirLines) {
    const OptionParser parser("devices", "", "One\ntwo.\n  a  first\n  b  second");
    testing::internal::CaptureStdout();
    EXPECT_TRUE(parser.parse({"--help"}).ok());
    const std::string help = testing::internal::GetCapturedStdout();
    EXPECT_TRUE(help.starts_with("Usage: raypager devices\n\nOne two.\n  a  first\n  b  second\n\nOptions")) << help;
}

TEST(CliOptions, VerbsWithoutInputsRefuseThem) {
    const OptionParser parser("devices", "", "");
    const auto outcome = parser.parse({"stray"});
    ASSERT_FALSE(outcome.ok());
    EXPECT_EQ(outcome.status().exit_code(), 2);
    EXPECT_NE(outcome.status().message().find("'stray'"), std::string::npos);
}

BakedScene wide_scene() {
    BakedScene scene;
    scene.width = 200;
    scene.height = 100;
    scene.spp = 32;
    scene.camera.right = {2, 0, 0};  // a field of view of 90 degrees on the shorter side, 200 x 100 square pixels
    scene.camera.up = {0, 1, 0};
    scene.camera.forward = {0, 0, 1};
    return scene;
}

TEST(CliOptions, SceneFillsInWhatIsNotGiven) {
    const auto options = effective_options(parsed({"a.rpb", "-o", "a.pfm"}), support::blocks_of(wide_scene()));
    ASSERT_TRUE(options.ok());
    EXPECT_EQ(options->width, 200u);
    EXPECT_EQ(options->height, 100u);
    EXPECT_EQ(options->spp, 32u);
    ASSERT_TRUE(options->camera);
    EXPECT_EQ(options->camera->right, (Float3{2, 0, 0}));
    EXPECT_EQ(options->camera->up, (Float3{0, 1, 0}));
}

TEST(CliOptions, TimeAloneTakesSamplesUntilThen) {
    EXPECT_EQ(effective_options(parsed({"a.rpb", "-o", "a.pfm", "--time", "5"}), support::blocks_of(wide_scene()))->spp, 65535u);
    EXPECT_EQ(effective_options(parsed({"a.rpb", "-o", "a.pfm", "--time", "5", "--spp", "8"}), support::blocks_of(wide_scene()))->spp, 8u);
}

// The shorter side keeps its extent of 1 at distance 1; pixels stay square.
TEST(CliOptions, CameraIsFittedToAnotherShapeOfPicture) {
    struct Case {
        const char* size;
        float right, up;
    };
    for (const Case& expected : {Case{"100x100", 1, 1}, Case{"300x100", 3, 1}, Case{"100x400", 1, 4}, Case{"400x200", 2, 1}}) {
        const auto options = effective_options(parsed({"a.rpb", "-o", "a.pfm", "--size", expected.size}), support::blocks_of(wide_scene()));
        ASSERT_TRUE(options.ok() && options->camera) << expected.size;
        EXPECT_FLOAT_EQ(options->camera->right.x, expected.right) << expected.size;
        EXPECT_FLOAT_EQ(options->camera->up.y, expected.up) << expected.size;
        EXPECT_EQ(options->camera->forward, (Float3{0, 0, 1})) << expected.size;
    }
}

// Whatever the scene's own camera does with left and right (see also CliCamera).
TEST(CliOptions, GivenCamerasSayThemselvesWhetherTheyMirror) {
    BakedScene scene = wide_scene();
    for (const float side : {1.f, -1.f})
        for (const std::string word : {"", ",mirrored"}) {
            scene.camera.right = {2 * side, 0, 0};
            const auto options =
                effective_options(parsed({"a.rpb", "-o", "a.pfm", "--camera", "0,0,5,0,0,0,0,1,0,90" + word}), support::blocks_of(scene));
            ASSERT_TRUE(options.ok() && options->camera);
            EXPECT_EQ(options->camera->right.x > 0, word.empty()) << "side " << side;
            EXPECT_EQ(options->camera->eye, (Float3{0, 0, 5}));
        }
}

}  // namespace
}  // namespace raypager
