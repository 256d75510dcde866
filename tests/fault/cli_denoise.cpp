// render --denoise from end to end, with a library that takes means of 3x3 pixels (tests/support/fake_oidn).
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "raypager/denoise.hpp"
#include "raypager/picture.hpp"
#include "support/temporary_folder.hpp"

namespace raypager {
namespace {

using support::read_file;

class CliDenoise : public testing::Test {
protected:
    void SetUp() override {
        std::ofstream(folder_ / "wedge.off")
            << "OFF\n5 6 0\n0 0 0\n2 0 0\n2 0 1\n0 0 1\n0.3 1.4 0.8\n3 0 1 2\n3 0 2 3\n3 0 4 1\n3 1 4 2\n3 2 4 3\n3 3 4 0\n";
    }
    // before: in front of the program, such as variables. The exit status.
    int render(const std::string& arguments, const std::string& before, const char* program = RAYPAGER_PROGRAM) const {
        const std::string command =
            fmt::format("cd '{}' && {} timeout 120 '{}' render wedge.off --size 24x16 --spp 2 {} >.stdout 2>.stderr </dev/null", folder_.string(),
                        before, program, arguments);
        const int raw = std::system(command.c_str());
        return WIFEXITED(raw) ? WEXITSTATUS(raw) : -1;
    }
    void expect_done(const std::string& arguments, const char* program = RAYPAGER_PROGRAM) const {
        EXPECT_EQ(render(arguments, with_fake_, program), 0) << arguments << "\n" << errors();
    }
    std::string errors() const { return read_file(folder_ / ".stderr"); }
    Image image(const std::string& name) const {
        const auto image = read_image(folder_ / name);
        EXPECT_TRUE(image.ok()) << image.status().message();
        return image ? *image : Image();
    }
    Image denoised(const std::string& name) const {
        const auto result = denoise(image(name), nullptr, nullptr, {RAYPAGER_FAKE_OIDN_2});
        EXPECT_TRUE(result.ok()) << result.status().message();
        return result ? *result : Image();
    }
    nlohmann::json report() const { return nlohmann::json::parse(read_file(folder_ / "r.json"), nullptr, false); }

    const support::TemporaryFolder temporary_;
    const std::filesystem::path folder_ = temporary_.path();
    const std::string with_fake_ = fmt::format("RAYPAGER_OIDN='{}'", RAYPAGER_FAKE_OIDN_2);
};

TEST_F(CliDenoise, WritesThePictureWithoutNoiseAndKeepsTheFilm) {
    expect_done("-o noisy.pfm --report r.json");
    const auto noisy = report();
    EXPECT_TRUE(noisy["settings"]["denoise"].is_null());
    expect_done("-o clean.pfm --denoise --report r.json");
    EXPECT_EQ(report()["settings"]["denoise"], "Open Image Denoise 2.5.1");
    EXPECT_TRUE(report()["settings"]["layers"].is_null());
    EXPECT_EQ(report()["image"]["film_hash"], noisy["image"]["film_hash"]) << "the hash is that of what was rendered";
    EXPECT_EQ(image("clean.pfm").values, denoised("noisy.pfm").values);
    EXPECT_NE(image("clean.pfm").values, image("noisy.pfm").values);
}

// Whatever the exposure, the same is taken for noise.
TEST_F(CliDenoise, ComesBeforeTheExposure) {
    expect_done("-o plain.pfm --denoise");
    expect_done("-o bright.pfm --denoise --exposure 3");
    Image plain = image("plain.pfm");
    expose(plain, 3);
    EXPECT_EQ(image("bright.pfm").values, plain.values);
}

TEST_F(CliDenoise, WritesTheLayersThatWereAskedForAlone) {
    if (!std::filesystem::exists(RAYPAGER_WHOLE_PROGRAM)) GTEST_SKIP() << "layers need OpenImageIO";
    expect_done("-o a.exr --denoise --layers depth --report r.json", RAYPAGER_WHOLE_PROGRAM);
    EXPECT_EQ(report()["settings"]["layers"], "depth");
    EXPECT_EQ(report()["layers"]["names"], nlohmann::json({"albedo", "normal", "depth"})) << "what the film has";
    const std::string file = read_file(folder_ / "a.exr").substr(0, 4096);
    EXPECT_NE(file.find(std::string("Z\0", 2)), std::string::npos);
    EXPECT_EQ(file.find("albedo.R"), std::string::npos);
    EXPECT_EQ(file.find("N.X"), std::string::npos);
}

TEST_F(CliDenoise, DenoisesAllPicturesOfATurntable) {
    expect_done("-o noisy.pfm --turntable 2");
    expect_done("-o clean.pfm --turntable 2 --denoise");
    for (const std::string number : {"000", "001"}) EXPECT_EQ(image("clean_" + number + ".pfm").values, denoised("noisy_" + number + ".pfm").values);
}

TEST_F(CliDenoise, DenoisesSnapshots) {
    EXPECT_EQ(render("-o a.pfm --snapshots 0.000001 --denoise", with_fake_ + " FAKE_OIDN_LOG=log"), 0) << errors();
    const std::string log = read_file(folder_ / "log"), last = "albedo output\nnormal output\nalbedo color normal output cleanAux hdr\n";
    ASSERT_TRUE(log.ends_with(last)) << log;
    EXPECT_TRUE(log.starts_with("albedo color normal output hdr\n")) << "no snapshot, or one that took its time: " << log;
}

TEST_F(CliDenoise, ACheckpointHasItsLayers) {
    expect_done("-o a.pfm --denoise --checkpoint c");
    EXPECT_EQ(render("-o a.pfm --checkpoint c --resume", with_fake_), 1);
    EXPECT_NE(errors().find("its --layers are albedo,normal, not none (--denoise adds albedo and normal)"), std::string::npos) << errors();
    expect_done("-o b.pfm --denoise --checkpoint c --resume");
    EXPECT_EQ(image("a.pfm").values, image("b.pfm").values);
}

TEST_F(CliDenoise, WithoutALibraryNothingIsRendered) {
    EXPECT_EQ(render("-o a.pfm --denoise", "RAYPAGER_OIDN=absent.so"), 1);
    EXPECT_NE(errors().find("raypager: --denoise: RAYPAGER_OIDN: absent.so: "), std::string::npos) << errors();
    EXPECT_FALSE(std::filesystem::exists(folder_ / "a.pfm"));
    EXPECT_FALSE(std::filesystem::exists(folder_ / "wedge.off.rpb")) << "not even baked";
}

// Hours of rendering are not thrown away because of what comes behind them.
TEST_F(CliDenoise, AFailureLeavesThePictureWithItsNoise) {
    expect_done("-o noisy.pfm");
    EXPECT_EQ(render("-o a.pfm --denoise --report r.json", with_fake_ + " FAKE_OIDN_FAILS=execute"), 1);
    EXPECT_NE(errors().find("a.pfm is the picture with its noise: denoising failed: "), std::string::npos) << errors();
    EXPECT_NE(errors().find("out of memory"), std::string::npos) << errors();
    EXPECT_EQ(image("a.pfm").values, image("noisy.pfm").values);
    EXPECT_TRUE(report().contains("image"));
}

}  // namespace
}  // namespace raypager
