// Images of textures through OpenImageIO: all kinds of values and channels, tiles, and what is damaged.
#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <random>

#include "base/half.hpp"
#include "image/formats.hpp"
#include "raypager/image_source.hpp"
#include "support/sanitizers.hpp"
#include "support/temporary_folder.hpp"

#if RAYPAGER_ADDRESS_SANITIZER
#include <sanitizer/lsan_interface.h>
#endif

namespace raypager {
namespace {

using Kind = ImageEncoding::Kind;

class TextureSources : public ::testing::Test {
protected:
    static void SetUpTestSuite() { use_openimageio(); }

    // Values of the type, channels side by side.
    template <class T>
    std::filesystem::path write(const char* name, int width, int height, int channels, OIIO::TypeDesc type, const std::vector<T>& values,
                                const std::function<void(OIIO::ImageSpec&)>& change = {}) const {
        const std::filesystem::path path = folder_ / name;
        const auto output = OIIO::ImageOutput::create(path.string());
        OIIO::ImageSpec spec(width, height, channels, type);
        spec.attribute("oiio:UnassociatedAlpha", 1);
        if (change) change(spec);
        EXPECT_TRUE(output->open(path.string(), spec)) << output->geterror();
        EXPECT_TRUE(output->write_image(OIIO::TypeDesc(OIIO::BaseTypeFromC<T>::value), values.data())) << output->geterror();
        EXPECT_TRUE(output->close());
        return path;
    }

    support::TemporaryFolder folder_;
};

ImageShape shape_of(const ImageSource& source) {
    const auto shape = source.shape();
    EXPECT_TRUE(shape.ok()) << shape.status().message();
    return shape.ok() ? *shape : ImageShape();
}

template <class T>
std::vector<T> read(const ImageSource& source) {
    std::vector<std::byte> bytes;
    const Status status = source.read([&](std::span<const std::byte> rows) {
        bytes.insert(bytes.end(), rows.begin(), rows.end());
        return Status();
    });
    EXPECT_TRUE(status.ok()) << status.message();
    std::vector<T> values(bytes.size() / sizeof(T));
    if (!values.empty()) std::memcpy(values.data(), bytes.data(), bytes.size());
    return values;
}

std::vector<float> read_halves(const ImageSource& source) {
    std::vector<float> values;
    for (const uint16_t half : read<uint16_t>(source)) values.push_back(float_of_half(half));
    return values;
}

template <class T>
std::vector<T> ramp(size_t count) {
    std::vector<T> values(count);
    for (size_t i = 0; i < count; i++) values[i] = static_cast<T>(i * 37);
    return values;
}

TEST_F(TextureSources, ChannelsBecomeGreyOrColourAndAlpha) {
    const auto gray = image_file_source(write<uint8_t>("1.png", 7, 3, 1, OIIO::TypeDesc::UINT8, ramp<uint8_t>(21)));
    EXPECT_EQ(shape_of(*gray).channels, 1u);
    EXPECT_TRUE(shape_of(*gray).srgb);
    EXPECT_EQ(read<uint8_t>(*gray), ramp<uint8_t>(21));
    const auto with_alpha = image_file_source(write<uint8_t>("2.png", 2, 1, 2, OIIO::TypeDesc::UINT8, {10, 20, 30, 0}, [](OIIO::ImageSpec& spec) {
        spec.alpha_channel = 1;
        spec.channelnames = {"Y", "A"};
    }));
    EXPECT_EQ(read<uint8_t>(*with_alpha), (std::vector<uint8_t>{10, 10, 10, 20, 30, 30, 30, 0}));
    const auto color = image_file_source(write<uint8_t>("3.png", 2, 1, 3, OIIO::TypeDesc::UINT8, {1, 2, 3, 4, 5, 6}));
    EXPECT_EQ(read<uint8_t>(*color), (std::vector<uint8_t>{1, 2, 3, 255, 4, 5, 6, 255}));
    // Colours stay as they are where alpha is 0.
    const auto four = image_file_source(write<uint8_t>("4.png", 2, 1, 4, OIIO::TypeDesc::UINT8, {1, 2, 3, 0, 50, 60, 70, 80}));
    EXPECT_EQ(read<uint8_t>(*four), (std::vector<uint8_t>{1, 2, 3, 0, 50, 60, 70, 80}));
    const auto six = image_file_source(write<uint8_t>("6.tif", 1, 1, 6, OIIO::TypeDesc::UINT8, {1, 2, 3, 4, 5, 6}));
    EXPECT_EQ(read<uint8_t>(*six), (std::vector<uint8_t>{1, 2, 3, 4}));
}

TEST_F(TextureSources, KindsOfValues) {
    const auto words = write<uint16_t>("a.png", 4, 1, 1, OIIO::TypeDesc::UINT16, {0, 1000, 40000, 65535});
    EXPECT_EQ(read<uint16_t>(*image_file_source(words, {Kind::linear, 1})), (std::vector<uint16_t>{0, 1000, 40000, 65535}));
    const auto decoded = read<uint16_t>(*image_file_source(words, {Kind::srgb, 1}));
    EXPECT_EQ(decoded[2], std::lround(65535 * decode_srgb(40000 / 65535.0f)));
    EXPECT_FALSE(shape_of(*image_file_source(words)).srgb);
    const std::vector<float> values = {0.5f, -2, 70000, std::numeric_limits<float>::quiet_NaN(), -INFINITY, 1};
    const auto floats = image_file_source(write<float>("a.exr", 2, 1, 3, OIIO::TypeDesc::FLOAT, values));
    EXPECT_EQ(shape_of(*floats).kind, TexelKind::half);
    EXPECT_EQ(read_halves(*floats), (std::vector<float>{0.5f, -2, 65504, 1, 0, -65504, 1, 1}));
    const auto halves = image_file_source(
        write<float>("b.exr", 2, 1, 3, OIIO::TypeDesc::HALF, {0.5f, -2, 0.25f, std::numeric_limits<float>::quiet_NaN(), INFINITY, 8}));
    EXPECT_EQ(read_halves(*halves), (std::vector<float>{0.5f, -2, 0.25f, 1, 0, 65504, 8, 1}));
    const auto longs = image_file_source(write<uint32_t>("c.tif", 2, 1, 1, OIIO::TypeDesc::UINT32, {0, UINT32_MAX}));
    EXPECT_EQ(read_halves(*longs), (std::vector<float>{0, 1}));
}

TEST_F(TextureSources, WhatTheFileSaysOfItsColours) {
    const auto space_of = [&](const char* name, const char* space) {
        return image_file_source(write<uint8_t>(name, 1, 1, 1, OIIO::TypeDesc::UINT8, {128}, [space](OIIO::ImageSpec& spec) {
            spec.attribute("oiio:ColorSpace", space);
            if (std::string_view(space).starts_with("Gamma")) spec.attribute("oiio:Gamma", 1.8f);
        }));
    };
    EXPECT_TRUE(shape_of(*space_of("srgb.png", "sRGB")).srgb);
    const auto linear = space_of("linear.png", "Linear");
    EXPECT_FALSE(shape_of(*linear).srgb);
    EXPECT_EQ(shape_of(*linear).kind, TexelKind::unsigned_8);
    const auto gamma = space_of("gamma.png", "GammaCorrected1.8");
    EXPECT_EQ(shape_of(*gamma).kind, TexelKind::unsigned_16);
    EXPECT_NEAR(read<uint16_t>(*gamma)[0], 65535 * std::pow(128 / 255.0, 1.8), 40);
    EXPECT_TRUE(shape_of(*image_file_source(gamma->name(), {Kind::srgb, 1})).srgb);
}

TEST_F(TextureSources, TiledFilesComeInRowsOfTiles) {
    const auto tiled = [](OIIO::ImageSpec& spec) { spec.tile_width = 32, spec.tile_height = 16; };
    for (const char* name : {"a.exr", "a.tif", "a.tx"}) {
        SCOPED_TRACE(name);
        const bool exr = std::string_view(name) == "a.exr";
        const auto values = ramp<uint8_t>(100 * 70 * 3);
        std::vector<float> as_floats(values.begin(), values.end());
        const auto path = exr ? write<float>(name, 100, 70, 3, OIIO::TypeDesc::HALF, as_floats, tiled)
                              : write<uint8_t>(name, 100, 70, 3, OIIO::TypeDesc::UINT8, values, tiled);
        const auto source = image_file_source(path);
        const std::vector<float> read_back = exr ? read_halves(*source) : [&] {
            const auto bytes = read<uint8_t>(*source);
            return std::vector<float>(bytes.begin(), bytes.end());
        }();
        ASSERT_EQ(read_back.size(), 100u * 70 * 4);
        for (size_t i = 0; i < values.size(); i++) ASSERT_EQ(read_back[i / 3 * 4 + i % 3], values[i]) << i;
        size_t largest = 0;
        ASSERT_TRUE(source->read([&](std::span<const std::byte> rows) { return largest = std::max(largest, rows.size()), Status(); }).ok());
        EXPECT_EQ(largest, 16u * 100 * 4 * (exr ? 2 : 1));
    }
}

#if RAYPAGER_ADDRESS_SANITIZER
using LibraryLeaks = __lsan::ScopedDisabler;
#else
struct LibraryLeaks {
    ~LibraryLeaks() {}
};
#endif

// Through to the last row: many a file is found to be damaged only then.
Status read_to_the_end(const std::filesystem::path& path, uint64_t most_bytes) {
    const auto source = image_file_source(path);
    if (const auto shape = source->shape(); !shape) return shape.status();
    uint64_t bytes = 0;
    return source->read([&](std::span<const std::byte> rows) {
        bytes += rows.size();
        return bytes > most_bytes ? Status::failed(path.string() + ": more bytes than there can be") : Status();
    });
}

TEST_F(TextureSources, DamagedOnesAreOneClearError) {
    const LibraryLeaks scope;
    const std::vector<float> values(40 * 30 * 3, 0.25f);
    for (const char* ending : {".exr", ".png", ".tif", ".jpg"}) {
        SCOPED_TRACE(ending);
        const std::string name = std::string("whole") + ending;
        std::mt19937 random(5);
        std::vector<uint8_t> bytes(40 * 30 * 3);
        for (uint8_t& byte : bytes) byte = static_cast<uint8_t>(random());
        const auto whole = std::string_view(ending) == ".exr" ? write<float>(name.c_str(), 40, 30, 3, OIIO::TypeDesc::HALF, values)
                                                              : write<uint8_t>(name.c_str(), 40, 30, 3, OIIO::TypeDesc::UINT8, bytes);
        ASSERT_TRUE(read_to_the_end(whole, UINT64_MAX).ok());
        const std::string content = support::read_file(whole);
        const std::filesystem::path cut = folder_ / (std::string("cut") + ending), flipped = folder_ / (std::string("flipped") + ending);
        for (size_t i = 0; i < 20; i++) {
            std::ofstream(cut, std::ios::binary) << content.substr(0, content.size() * i / 21);
            const Status status = read_to_the_end(cut, UINT64_MAX);
            // A JPEG that ends too soon is grey from there on; its reader warns of nothing.
            if (std::string_view(ending) == ".jpg" && status.ok()) continue;
            ASSERT_FALSE(status.ok()) << i;
            EXPECT_NE(status.message().find(cut.filename().string()), std::string::npos) << status.message();
            EXPECT_EQ(status.message().find('\n'), std::string::npos) << status.message();
        }
        for (int i = 0; i < 100; i++) {
            std::string damaged = content;
            damaged[random() % std::min<size_t>(damaged.size(), i % 2 ? 300 : SIZE_MAX)] ^= static_cast<char>(1u << random() % 8);
            std::ofstream(flipped, std::ios::binary) << damaged;
            const Status status = read_to_the_end(flipped, uint64_t{64} << 20);
            EXPECT_TRUE(status.ok() || status.message().find(flipped.filename().string()) != std::string::npos) << status.message();
        }
    }
    for (const char* name : {"missing.png", "missing.nothing", "missing"}) {
        const Status status = image_file_source(folder_ / name)->shape().status();
        ASSERT_FALSE(status.ok());
        EXPECT_NE(status.message().find(name), std::string::npos) << status.message();
    }
    const auto text = image_file_source(folder_.write("text.png", "This is no image."))->shape();
    ASSERT_FALSE(text.ok());
    EXPECT_NE(text.status().message().find("text.png"), std::string::npos);
}

TEST_F(TextureSources, HugePromisesAreRefused) {
    std::string content = support::read_file(write<uint8_t>("a.png", 2, 2, 1, OIIO::TypeDesc::UINT8, {1, 2, 3, 4}));
    for (const char* size : {"\x7f\xff\xff\xff", "\x3b\x9a\xca\x00", "\x00\x0f\xff\xff"}) {
        for (const size_t at : {16u, 20u}) content.replace(at, 4, std::string(size, 4));
        const auto shape = image_file_source(folder_.write("huge.png", content))->shape();
        ASSERT_FALSE(shape.ok());
        EXPECT_NE(shape.status().message().find("huge.png"), std::string::npos) << shape.status().message();
    }
}

}  // namespace
}  // namespace raypager
