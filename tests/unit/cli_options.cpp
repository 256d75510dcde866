// The options of a verb as a whole: what is taken, and what is refused as bad usage with the option's name.
#include <gtest/gtest.h>

#include <cmath>

#include "cli/option_parser.hpp"
#include "cli/render_settings.hpp"

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
    EXPECT_EQ(settings.options.policy, PolicyKind::aged_wants);
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
    EXPECT_EQ(settings.options.paths, 1000000u);
    EXPECT_EQ(settings.options.policy, PolicyKind::most_wanted);
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
    const auto options = effective_options(parsed({"a.rpb", "-o", "a.pfm"}), wide_scene());
    ASSERT_TRUE(options.ok());
    EXPECT_EQ(options->width, 200u);
    EXPECT_EQ(options->height, 100u);
    EXPECT_EQ(options->spp, 32u);
    ASSERT_TRUE(options->camera);
    EXPECT_EQ(options->camera->right, (Float3{2, 0, 0}));
    EXPECT_EQ(options->camera->up, (Float3{0, 1, 0}));
}

TEST(CliOptions, TimeAloneTakesSamplesUntilThen) {
    EXPECT_EQ(effective_options(parsed({"a.rpb", "-o", "a.pfm", "--time", "5"}), wide_scene())->spp, 65535u);
    EXPECT_EQ(effective_options(parsed({"a.rpb", "-o", "a.pfm", "--time", "5", "--spp", "8"}), wide_scene())->spp, 8u);
}

// The shorter side keeps its extent of 1 at distance 1; pixels stay square.
TEST(CliOptions, CameraIsFittedToAnotherShapeOfPicture) {
    struct Case {
        const char* size;
        float right, up;
    };
    for (const Case& expected : {Case{"100x100", 1, 1}, Case{"300x100", 3, 1}, Case{"100x400", 1, 4}, Case{"400x200", 2, 1}}) {
        const auto options = effective_options(parsed({"a.rpb", "-o", "a.pfm", "--size", expected.size}), wide_scene());
        ASSERT_TRUE(options.ok() && options->camera) << expected.size;
        EXPECT_FLOAT_EQ(options->camera->right.x, expected.right) << expected.size;
        EXPECT_FLOAT_EQ(options->camera->up.y, expected.up) << expected.size;
        EXPECT_EQ(options->camera->forward, (Float3{0, 0, 1})) << expected.size;
    }
}

// right x up and forward point the same way in one handedness and opposite ways in the other.
double handedness(const Camera& camera) {
    const Float3 &r = camera.right, &u = camera.up, &f = camera.forward;
    return (double(r.y) * u.z - double(r.z) * u.y) * f.x + (double(r.z) * u.x - double(r.x) * u.z) * f.y +
           (double(r.x) * u.y - double(r.y) * u.x) * f.z;
}

TEST(CliOptions, GivenCameraKeepsTheHandednessOfTheScene) {
    const RenderSettings settings = parsed({"a.rpb", "-o", "a.pfm", "--camera", "0,0,-5,0,0,0,0,1,0,90"});
    BakedScene scene = wide_scene();
    for (const float side : {1.f, -1.f}) {
        scene.camera.right = {2 * side, 0, 0};
        const auto options = effective_options(settings, scene);
        ASSERT_TRUE(options.ok() && options->camera);
        EXPECT_GT(handedness(*options->camera) * handedness(scene.camera), 0) << "side " << side;
        EXPECT_EQ(options->camera->eye, (Float3{0, 0, -5}));
    }
}

}  // namespace
}  // namespace raypager
