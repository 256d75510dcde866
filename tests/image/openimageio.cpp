// Pictures through OpenImageIO: EXR exact, PNG within its 8 bits, integer elevation as stored.
#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "base/files.hpp"
#include "image/formats.hpp"
#include "raypager/film_layers.hpp"
#include "raypager/picture.hpp"
#include "support/failing_file_system.hpp"
#include "support/temporary_folder.hpp"

namespace raypager {
namespace {

class ImageOpenImageIo : public ::testing::Test {
protected:
    static void SetUpTestSuite() { use_openimageio(); }
};

TEST_F(ImageOpenImageIo, IsThereBeforeTheWorkIsDone) {
    const support::TemporaryFolder folder;
    for (const char* name : {"x.exr", "x.png", "x.PNG", "x.pfm"}) EXPECT_TRUE(check_writable_image(folder / name).ok()) << name;
    EXPECT_FALSE(check_writable_image(folder / "x.gif").ok());
}

Image ramp(uint32_t width, uint32_t height, uint32_t channels) {
    Image image{width, height, channels, {}};
    for (size_t i = 0; i < size_t{width} * height * channels; i++) image.values.push_back(static_cast<float>(i) / 977.0f);
    return image;
}

// EXR keeps colours that are multiplied by alpha, PNG has them as they are without it.
TEST_F(ImageOpenImageIo, AlphaIsWrittenAsTheFormatHasIt) {
    const support::TemporaryFolder folder;
    const Image image{3, 1, 4, {0.25f, 0.125f, 0, 0.5f, 0, 0, 0, 0, 1, 0.5f, 0.25f, 1}};
    const auto channels_of = [&](const char* name) {
        EXPECT_TRUE(write_image(folder / name, image).ok());
        const auto input = OIIO::ImageInput::open((folder / name).string());
        OIIO::ImageSpec as_stored = input->spec();
        as_stored.attribute("oiio:UnassociatedAlpha", 1);
        const auto raw = OIIO::ImageInput::open((folder / name).string(), &as_stored);
        EXPECT_EQ(raw->spec().nchannels, 4);
        EXPECT_EQ(raw->spec().alpha_channel, 3);
        std::vector<float> values(12);
        EXPECT_TRUE(raw->read_image(0, 0, 0, 4, OIIO::TypeDesc::FLOAT, values.data()));
        return values;
    };
    EXPECT_EQ(channels_of("a.exr"), image.values);
    const auto png = channels_of("a.png");
    const float expected[12] = {0.735357f, 0.537099f, 0, 0.5f, 0, 0, 0, 0, 1, 0.735357f, 0.537099f, 1};  // 0.5 and 0.25 as sRGB
    for (size_t i = 0; i < 12; i++) EXPECT_NEAR(png[i], expected[i], 0.5 / 255 + 1e-5) << i;
    EXPECT_NE(write_image(folder / "a.pfm", image).message().find("alpha"), std::string::npos);
}

TEST_F(ImageOpenImageIo, LayersAreChannelsBesideThePicture) {
    const support::TemporaryFolder folder;
    const std::filesystem::path path = folder / "a.exr";
    const Image picture{2, 1, 4, {0.5f, 1, 2, 1, 0, 0.25f, 0, 0.5f}};
    const float infinity = std::numeric_limits<float>::infinity();
    const std::vector<FilmLayerImage> layers = {{FilmLayer::albedo, {2, 1, 3, {0.1f, 0.2f, 0.3f, 0.4f, 0.5f, 0.6f}}},
                                                {FilmLayer::depth, {2, 1, 1, {1.5f, infinity}}},
                                                {FilmLayer::instance, {2, 1, 1, {16777215, 0}}}};
    const Status written = write_image_with_layers(path, picture, layers);
    ASSERT_TRUE(written.ok()) << written.message();
    const auto input = OIIO::ImageInput::open(path.string());
    ASSERT_TRUE(input);
    const OIIO::ImageSpec& spec = input->spec();
    std::vector<float> values(2 * static_cast<size_t>(spec.nchannels));
    ASSERT_TRUE(input->read_image(0, 0, 0, spec.nchannels, OIIO::TypeDesc::FLOAT, values.data()));
    const auto value = [&](const std::string& name, size_t pixel) {
        const int channel = spec.channelindex(name);
        EXPECT_GE(channel, 0) << name;
        return values[pixel * static_cast<size_t>(spec.nchannels) + static_cast<size_t>(channel)];
    };
    EXPECT_EQ(spec.nchannels, 9);
    EXPECT_EQ(value("B", 0), 2);
    EXPECT_EQ(value("A", 1), 0.5f);
    EXPECT_EQ(value("albedo.G", 0), 0.2f);
    EXPECT_EQ(value("albedo.B", 1), 0.6f);
    EXPECT_EQ(value("Z", 0), 1.5f);
    EXPECT_EQ(value("Z", 1), infinity);
    EXPECT_EQ(value("instance", 0), 16777215);
    // Whoever asks for the picture gets it.
    const auto read = read_image(path);
    ASSERT_TRUE(read.ok()) << read.status().message();
    EXPECT_EQ(read->values, (std::vector<float>{0.5f, 1, 2, 0, 0.25f, 0}));
    for (const char* name : {"a.png", "a.pfm"}) EXPECT_EQ(write_image_with_layers(folder / name, picture, layers).kind(), ErrorKind::usage) << name;
}

TEST_F(ImageOpenImageIo, ExposureLeavesAlphaAlone) {
    Image image{1, 1, 4, {0.25f, 0.5f, 1, 0.5f}};
    expose(image, 1);
    EXPECT_EQ(image.values, (std::vector<float>{0.5f, 1, 2, 0.5f}));
    Image opaque{1, 1, 3, {0.25f, 0.5f, 1}};
    expose(opaque, -2);
    EXPECT_EQ(opaque.values, (std::vector<float>{0.0625f, 0.125f, 0.25f}));
}

void append_little_endian(std::string& text, uint64_t value, int bytes) {
    for (int i = 0; i < bytes; i++) text += static_cast<char>(value >> 8 * i);
}

TEST_F(ImageOpenImageIo, EndingsInCapitalsAreReadAsTheyAreWritten) {
    const support::TemporaryFolder folder;
    for (const char* name : {"A.PNG", "A.Exr"}) {
        ASSERT_TRUE(write_image(folder / name, ramp(9, 7, 3)).ok());
        const auto back = read_image(folder / name);
        ASSERT_TRUE(back.ok()) << back.status().message();
        EXPECT_EQ(back->width, 9u);
    }
}

// An uncompressed little-endian TIFF of one strip with one signed 16-bit channel (TIFF 6.0, section 3).
std::string elevation_tiff(uint32_t width, uint32_t height, const std::vector<int16_t>& values) {
    const auto bytes = static_cast<uint32_t>(values.size() * 2);
    std::string text = "II";
    append_little_endian(text, 42, 2);
    append_little_endian(text, 8 + bytes, 4);  // where the directory lies: behind the pixels
    for (const int16_t value : values) append_little_endian(text, static_cast<uint16_t>(value), 2);
    const uint32_t entries[][3] = {{256, 4, width}, {257, 4, height}, {258, 3, 16},     {259, 3, 1},     {262, 3, 1},
                                   {273, 4, 8},     {277, 3, 1},      {278, 4, height}, {279, 4, bytes}, {339, 3, 2}};
    append_little_endian(text, std::size(entries), 2);
    for (const auto& [tag, type, value] : entries) {
        append_little_endian(text, tag, 2);
        append_little_endian(text, type, 2);
        append_little_endian(text, 1, 4);
        append_little_endian(text, value, 4);
    }
    append_little_endian(text, 0, 4);
    return text;
}

TEST_F(ImageOpenImageIo, ExrComesBackBitForBit) {
    const support::TemporaryFolder folder;
    for (const uint32_t channels : {1u, 3u}) {
        Image image = ramp(37, 150, channels);  // more rows than are read at once
        image.values[5] = 1e30f;
        image.values[6] = 1e-30f;
        ASSERT_TRUE(write_image(folder / "a.exr", image).ok());
        const auto back = read_image(folder / "a.exr");
        ASSERT_TRUE(back.ok()) << back.status().message();
        EXPECT_EQ(back->channels, channels);
        EXPECT_EQ(back->values, image.values);
    }
    EXPECT_EQ(folder.files().size(), 1u);
}

TEST_F(ImageOpenImageIo, PngIsSrgbWithinItsSteps) {
    const support::TemporaryFolder folder;
    Image image = ramp(40, 8, 3);
    ASSERT_TRUE(write_image(folder / "a.png", image).ok());
    const auto back = read_image(folder / "a.png");
    ASSERT_TRUE(back.ok()) << back.status().message();
    for (size_t i = 0; i < image.values.size(); i++)
        EXPECT_EQ(encode_srgb8(back->values[i]), encode_srgb8(image.values[i])) << "value " << image.values[i];
    const auto raw = read_image(folder / "a.png", true);
    ASSERT_TRUE(raw.ok());
    for (size_t i = 0; i < image.values.size(); i++) EXPECT_EQ(raw->values[i], encode_srgb8(image.values[i]));
}

TEST_F(ImageOpenImageIo, RawElevationsAreTheStoredNumbers) {
    const support::TemporaryFolder folder;
    const std::vector<int16_t> heights = {-32768, -1, 0, 1, 2674, 32767};
    ASSERT_TRUE(write_text(folder / "h.tif", elevation_tiff(3, 2, heights)).ok());
    const auto image = read_image(folder / "h.tif", true);
    ASSERT_TRUE(image.ok()) << image.status().message();
    EXPECT_EQ(image->channels, 1u);
    EXPECT_EQ(image->values, (std::vector<float>{-32768, -1, 0, 1, 2674, 32767}));
    const auto scaled = read_image(folder / "h.tif");
    ASSERT_TRUE(scaled.ok());
    EXPECT_EQ(scaled->values.back(), 1.0f);
}

TEST_F(ImageOpenImageIo, AFailedWriteLeavesNothing) {
    const support::TemporaryFolder folder;
    support::FailingFileSystem disk;
    disk.error_number = ENOSPC;
    for (const char* name : {"a.exr", "a.png"}) {
        disk.fail_write_in = 1;
        const Status status = write_image(folder / name, ramp(30, 20, 3));
        EXPECT_EQ(disk.fail_write_in, 0) << name;
        EXPECT_FALSE(status.ok()) << name;
        EXPECT_TRUE(folder.files().empty()) << name;
    }
}

}  // namespace
}  // namespace raypager
