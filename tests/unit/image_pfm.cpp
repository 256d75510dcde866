// Portable float maps: values bit for bit, both byte orders, rows the right way up.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include "base/files.hpp"
#include "image/formats.hpp"
#include "support/failing_file_system.hpp"
#include "support/temporary_folder.hpp"

namespace raypager {
namespace {

Image random_image(uint32_t width, uint32_t height, uint32_t channels, uint32_t seed) {
    std::mt19937 random(seed);
    Image image{width, height, channels, {}};
    for (size_t i = 0; i < size_t{width} * height * channels; i++) image.values.push_back(static_cast<float>(random()) * 1e-6f - 2000.0f);
    return image;
}

void expect_same_bits(const Image& a, const Image& b) {
    ASSERT_EQ(a.width, b.width);
    ASSERT_EQ(a.height, b.height);
    ASSERT_EQ(a.channels, b.channels);
    ASSERT_EQ(a.values.size(), b.values.size());
    EXPECT_EQ(std::memcmp(a.values.data(), b.values.data(), a.values.size() * sizeof(float)), 0);
}

void append_float(std::string& text, float value, bool big_endian) {
    auto bits = std::bit_cast<uint32_t>(value);
    for (int i = 0; i < 4; i++) text += static_cast<char>(bits >> 8 * (big_endian ? 3 - i : i));
}

TEST(ImagePfm, ComesBackBitForBit) {
    const support::TemporaryFolder folder;
    for (const uint32_t channels : {1u, 3u})
        for (const auto& [width, height] : {std::pair{1u, 1u}, {7u, 5u}, {64u, 33u}}) {
            Image image = random_image(width, height, channels, 11 * channels + width);
            image.values[0] = NAN;  // kept: the format can hold it
            image.values.back() = INFINITY;
            ASSERT_TRUE(write_image(folder / "a.pfm", image).ok());
            const auto back = read_image(folder / "a.pfm");
            ASSERT_TRUE(back.ok()) << back.status().message();
            expect_same_bits(image, *back);
        }
}

TEST(ImagePfm, RowsRunFromBottomToTopInBothByteOrders) {
    const support::TemporaryFolder folder;
    for (const bool big_endian : {false, true}) {
        std::string text = big_endian ? "Pf\n2 2\n1.0\n" : "Pf\n2 2\n-1.0\n";
        for (const float value : {3.0f, 4.0f, 1.0f, 2.0f}) append_float(text, value, big_endian);
        ASSERT_TRUE(write_text(folder / "b.pfm", text).ok());
        const auto image = read_image(folder / "b.pfm");
        ASSERT_TRUE(image.ok()) << image.status().message();
        EXPECT_EQ(image->values, (std::vector<float>{1, 2, 3, 4})) << "big endian: " << big_endian;
    }
}

TEST(ImagePfm, TheScaleMultipliesUnlessRaw) {
    const support::TemporaryFolder folder;
    std::string text = "PF 1\t1\r\n-2.5 ";  // any white space separates
    for (const float value : {1.0f, 2.0f, -4.0f}) append_float(text, value, false);
    ASSERT_TRUE(write_text(folder / "c.pfm", text).ok());
    EXPECT_EQ(read_image(folder / "c.pfm")->values, (std::vector<float>{2.5f, 5, -10}));
    EXPECT_EQ(read_image(folder / "c.pfm", true)->values, (std::vector<float>{1, 2, -4}));
}

TEST(ImagePfm, AFailedWriteLeavesTheOldFile) {
    const support::TemporaryFolder folder;
    const Image old = random_image(5, 4, 3, 1);
    ASSERT_TRUE(write_image(folder / "d.pfm", old).ok());
    support::FailingFileSystem disk;
    disk.error_number = ENOSPC;
    disk.fail_write_in = 1;
    const Status status = write_image(folder / "d.pfm", random_image(50, 40, 3, 2));
    ASSERT_FALSE(status.ok());
    EXPECT_NE(status.message().find("d.pfm"), std::string::npos) << status.message();
    EXPECT_EQ(folder.files().size(), 1u);
    expect_same_bits(old, *read_image(folder / "d.pfm"));
}

TEST(ImageWritable, SaysNoBeforeTheWorkIsDone) {
    const support::TemporaryFolder folder;
    EXPECT_TRUE(check_writable_image(folder / "x.pfm").ok());
    EXPECT_TRUE(check_writable_image(folder / "x.PFM").ok());
    EXPECT_TRUE(check_writable_image("x.pfm").ok()) << "the current folder";
    EXPECT_FALSE(check_writable_image(folder / "x.gif").ok());
    EXPECT_FALSE(check_writable_image(folder / "x").ok());
    EXPECT_FALSE(check_writable_image(folder / "absent/x.pfm").ok());
    std::filesystem::create_directory(folder / "taken.pfm");
    EXPECT_FALSE(check_writable_image(folder / "taken.pfm").ok());
    EXPECT_FALSE(check_writable_image(folder / "x.exr").ok()) << "without a library for pictures";
}

TEST(ImageExposure, StaysFinite) {
    Image image;
    image.width = image.height = 1;
    image.channels = 3;
    image.values = {1, 1e30f, 0};
    expose(image, 64);
    EXPECT_EQ(image.values[0], std::exp2(64.0f));
    EXPECT_EQ(image.values[1], std::numeric_limits<float>::max());
    EXPECT_EQ(image.values[2], 0);
}

TEST(ImageSrgb, EncodesAsTheStandardSays) {
    // IEC 61966-2-1: the linear part below 0.0031308, the power law above; known pairs.
    EXPECT_EQ(encode_srgb8(0.0f), 0);
    EXPECT_EQ(encode_srgb8(1.0f), 255);
    EXPECT_EQ(encode_srgb8(0.5f), 188);
    EXPECT_EQ(encode_srgb8(0.2158605f), 128);
    EXPECT_EQ(encode_srgb8(0.001f), 3);
    EXPECT_EQ(encode_srgb8(-1.0f), 0);
    EXPECT_EQ(encode_srgb8(NAN), 0);
    EXPECT_EQ(encode_srgb8(INFINITY), 255);
}

TEST(ImageSrgb, DecodingThenEncodingIsTheIdentityOnBytes) {
    for (int byte = 0; byte < 256; byte++) EXPECT_EQ(encode_srgb8(decode_srgb(static_cast<float>(byte) / 255)), byte);
}

}  // namespace
}  // namespace raypager
