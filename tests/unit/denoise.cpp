// Denoising with a library that passes for Open Image Denoise (tests/support/fake_oidn) and takes means of 3x3 pixels.
#include "raypager/denoise.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <optional>

#include "support/environment.hpp"
#include "support/temporary_folder.hpp"

namespace raypager {
namespace {

using support::ScopedVariable;

Image picture_of(uint32_t width, uint32_t height, uint32_t channels, float value) {
    return {width, height, channels, std::vector<float>(size_t{width} * height * channels, value)};
}

// One bright pixel in the middle of 5x5.
Image firefly(uint32_t channels) {
    Image image = picture_of(5, 5, channels, 0);
    for (uint32_t c = 0; c < channels; c++) image.values[12 * channels + c] = 9;
    return image;
}

void expect_failure(const Result<Image>& result, const std::string& named, int exit_code = 1) {
    ASSERT_FALSE(result.ok()) << "expected an error about " << named;
    EXPECT_EQ(result.status().exit_code(), exit_code);
    EXPECT_NE(result.status().message().find(named), std::string::npos) << result.status().message();
    EXPECT_EQ(result.status().message().find('\n'), std::string::npos) << result.status().message();
}

class Denoise : public testing::TestWithParam<const char*> {
protected:
    const ScopedVariable library_{"RAYPAGER_OIDN", GetParam()};
};

TEST_P(Denoise, SpreadsAPixelOverThoseAroundIt) {
    for (const uint32_t channels : {3u, 4u}) {
        const Image noisy = firefly(channels);
        const auto result = denoise(noisy);
        ASSERT_TRUE(result.ok()) << result.status().message();
        ASSERT_EQ(result->values.size(), noisy.values.size());
        for (uint32_t y = 0; y < 5; y++)
            for (uint32_t x = 0; x < 5; x++) {
                const float* pixel = &result->values[size_t{y * 5 + x} * channels];
                const bool near = x >= 1 && x <= 3 && y >= 1 && y <= 3;
                for (int c = 0; c < 3; c++) EXPECT_FLOAT_EQ(pixel[c], near ? 1.0f : 0.0f) << x << " " << y;
                if (channels == 4) {
                    EXPECT_EQ(pixel[3], x == 2 && y == 2 ? 9.0f : 0.0f) << "alpha stays";
                }
            }
    }
}

// Planes that help are filtered alone first, and are said to be clean then. The fake logs what it is given.
TEST_P(Denoise, TakesAlbedoAndNormal) {
    const Image noisy = firefly(3), albedo = picture_of(5, 5, 3, 0.5f), normal = picture_of(5, 5, 3, -1);
    const support::TemporaryFolder calls;
    const ScopedVariable log_file("FAKE_OIDN_LOG", (calls.path() / "log").c_str());
    for (const bool fast : {false, true}) {
        const auto result = denoise(noisy, &albedo, &normal, {{}, fast});
        ASSERT_TRUE(result.ok()) << result.status().message();
        EXPECT_FLOAT_EQ(result->values[0], 0);
        EXPECT_FLOAT_EQ(result->values[size_t{12} * 3], 1);
        const auto log = support::read_file(calls.path() / "log");
        EXPECT_EQ(log, fast ? "albedo color normal output hdr\n" : "albedo output\nnormal output\nalbedo color normal output cleanAux hdr\n");
        std::filesystem::remove(calls.path() / "log");
    }
}

TEST_P(Denoise, MakesNumbersOfWhatIsNone) {
    Image noisy = picture_of(1, 3, 3, 3);
    noisy.values[0] = std::numeric_limits<float>::quiet_NaN();
    noisy.values[1] = -5;
    const auto result = denoise(noisy);
    ASSERT_TRUE(result.ok()) << result.status().message();
    EXPECT_FLOAT_EQ(result->values[0], 1.5f) << "the mean of 0 and 3";
    EXPECT_FLOAT_EQ(result->values[1], 1.5f);
    EXPECT_FLOAT_EQ(result->values[2], 3);
    Image bright = picture_of(1, 1, 3, std::numeric_limits<float>::infinity());
    const auto largest = denoise(bright);
    ASSERT_TRUE(largest.ok()) << largest.status().message();
    EXPECT_EQ(largest->values[0], std::numeric_limits<float>::max());
}

TEST_P(Denoise, PassesOnWhatTheLibrarySays) {
    const Image noisy = firefly(3);
    for (const auto& [failure, message] : {std::pair{"device", "this processor is too old"}, std::pair{"filter", "unknown filter"},
                                           std::pair{"execute", "out of memory"}, std::pair{"values", "not finite"}}) {
        const ScopedVariable fails("FAKE_OIDN_FAILS", failure);
        expect_failure(denoise(noisy), message);
        EXPECT_EQ(find_denoiser().ok(), failure != std::string("device")) << failure;
    }
    EXPECT_TRUE(denoise(noisy).ok()) << "an error is not kept";
}

TEST_P(Denoise, TellsItsVersionAndPlace) {
    const auto found = find_denoiser();
    ASSERT_TRUE(found.ok()) << found.status().message();
    EXPECT_EQ(found->version, GetParam() == std::string(RAYPAGER_FAKE_OIDN_1) ? "1.4.3" : "2.5.1");
    EXPECT_TRUE(std::filesystem::equivalent(found->library, GetParam()));
}

INSTANTIATE_TEST_SUITE_P(Versions, Denoise, testing::Values(RAYPAGER_FAKE_OIDN_1, RAYPAGER_FAKE_OIDN_2),
                         [](const auto& info) { return info.index == 0 ? "one" : "two"; });

TEST(DenoiseLibrary, RefusesImagesThatDoNotFit) {
    const Image noisy = firefly(3), small = picture_of(4, 5, 3, 0), grey = picture_of(5, 5, 1, 0);
    expect_failure(denoise(grey), "1 channels", 2);
    expect_failure(denoise({}), "empty", 2);
    expect_failure(denoise(noisy, &small), "4x5", 2);
    expect_failure(denoise(noisy, &grey), "albedo", 2);
    expect_failure(denoise(noisy, &noisy, &grey), "normal", 2);
    expect_failure(denoise(noisy, nullptr, &noisy), "give both", 2);
    Image short_of_values = noisy;
    short_of_values.values.pop_back();
    expect_failure(denoise(short_of_values), "values", 2);
    expect_failure(denoise(noisy, &short_of_values), "albedo", 2);
}

TEST(DenoiseLibrary, SaysWhatIsWrongWithIt) {
    const support::TemporaryFolder folder;
    const ScopedVariable absent("RAYPAGER_OIDN", (folder / "absent.so").c_str());
    expect_failure(denoise(firefly(3)), "RAYPAGER_OIDN: " + (folder / "absent.so").string());
    expect_failure(denoise(firefly(3), nullptr, nullptr, {folder.write("text.so", "no library")}), "text.so: the denoiser cannot be loaded");
    expect_failure(denoise(firefly(3), nullptr, nullptr, {RAYPAGER_FAKE_OIDN_0}), "has no function oidnSetFilterBool");
    const auto named = denoise(firefly(3), nullptr, nullptr, {RAYPAGER_FAKE_OIDN_2});
    EXPECT_TRUE(named.ok()) << "what is named goes before the variable: " << named.status().message();
}

// In a Python environment as pip makes it; and where there is none, the error says what to install.
TEST(DenoiseLibrary, IsFoundInPythonPackages) {
    const support::TemporaryFolder folder;
    const ScopedVariable none("RAYPAGER_OIDN", ""), home("HOME", folder.path().c_str()), environment("VIRTUAL_ENV", (folder / "venv").c_str());
    if (const auto installed = find_denoiser(); installed.ok()) GTEST_SKIP() << "one is installed: " << installed->library;
    expect_failure(denoise(firefly(3)), "pip install pyoidn");
    const auto library = folder / "venv/lib/python3.11/site-packages/pyoidn/oidn/lib/libOpenImageDenoise.so.2";
    std::filesystem::create_directories(library.parent_path());
    std::filesystem::copy_file(RAYPAGER_FAKE_OIDN_2, library);
    const auto found = find_denoiser();
    ASSERT_TRUE(found.ok()) << found.status().message();
    EXPECT_EQ(found->library, library);
}

}  // namespace
}  // namespace raypager
