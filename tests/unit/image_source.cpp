// Images of textures that every build reads: portable maps, and images in memory.
#include "raypager/image_source.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "base/half.hpp"
#include "image/formats.hpp"
#include "support/temporary_folder.hpp"

namespace raypager {
namespace {

using Kind = ImageEncoding::Kind;

std::vector<std::byte> texels_of(const ImageSource& source) {
    std::vector<std::byte> all;
    const Status status = source.read([&](std::span<const std::byte> rows) {
        all.insert(all.end(), rows.begin(), rows.end());
        return Status();
    });
    EXPECT_TRUE(status.ok()) << status.message();
    return all;
}

template <class T>
std::vector<T> values_of(const ImageSource& source) {
    const auto bytes = texels_of(source);
    std::vector<T> values(bytes.size() / sizeof(T));
    std::memcpy(values.data(), bytes.data(), bytes.size());
    return values;
}

std::vector<float> halves_of(const ImageSource& source) {
    std::vector<float> values;
    for (const uint16_t half : values_of<uint16_t>(source)) values.push_back(float_of_half(half));
    return values;
}

void expect_shape(const ImageSource& source, uint32_t width, uint32_t height, uint32_t channels, TexelKind kind, bool srgb) {
    const auto shape = source.shape();
    ASSERT_TRUE(shape.ok()) << shape.status().message();
    EXPECT_EQ(shape->width, width);
    EXPECT_EQ(shape->height, height);
    EXPECT_EQ(shape->channels, channels);
    EXPECT_EQ(shape->kind, kind);
    EXPECT_EQ(shape->srgb, srgb);
}

std::string floats(std::initializer_list<float> values) {
    std::string text;
    for (const float value : values) text.append(reinterpret_cast<const char*>(&value), 4);
    return text;
}

TEST(ImageFileSource, BinaryMapsOfBytes) {
    const support::TemporaryFolder folder;
    const auto gray = image_file_source(folder.write("a.pgm", "P5 # a comment\n#another\n3\t2\n255\n\x01\x02\x03\xfd\xfe\xff"));
    expect_shape(*gray, 3, 2, 1, TexelKind::unsigned_8, true);
    EXPECT_EQ(values_of<uint8_t>(*gray), (std::vector<uint8_t>{1, 2, 3, 253, 254, 255}));
    const auto linear = image_file_source(gray->name(), {Kind::linear, 1});
    expect_shape(*linear, 3, 2, 1, TexelKind::unsigned_8, false);
    const auto color = image_file_source(folder.write("a.ppm", "P6\n1 2\n255\nabcdef and what follows"));
    expect_shape(*color, 1, 2, 4, TexelKind::unsigned_8, true);
    EXPECT_EQ(values_of<uint8_t>(*color), (std::vector<uint8_t>{'a', 'b', 'c', 255, 'd', 'e', 'f', 255}));
    const auto fives = image_file_source(folder.write("five.pgm", std::string("P5 4 1 5\n\0\1\5\6", 13)));
    EXPECT_EQ(values_of<uint8_t>(*fives), (std::vector<uint8_t>{0, 51, 255, 255}));
}

TEST(ImageFileSource, BinaryMapsOfWords) {
    const support::TemporaryFolder folder;
    const std::filesystem::path path = folder.write("a.pgm", std::string("P5 3 1 65535\n\x12\x34\x80\x00\xff\xff", 19));
    const auto linear = image_file_source(path, {Kind::linear, 1});
    expect_shape(*linear, 3, 1, 1, TexelKind::unsigned_16, false);
    EXPECT_EQ(values_of<uint16_t>(*linear), (std::vector<uint16_t>{0x1234, 0x8000, 0xffff}));
    const auto srgb = image_file_source(path);
    expect_shape(*srgb, 3, 1, 1, TexelKind::unsigned_16, false);
    EXPECT_EQ(values_of<uint16_t>(*srgb)[1], std::lround(65535 * decode_srgb(0x8000 / 65535.0f)));
    const auto squared = image_file_source(path, {Kind::gamma, 2});
    EXPECT_EQ(values_of<uint16_t>(*squared)[1], std::lround(65535 * std::pow(0x8000 / 65535.0, 2)));
    // A gamma needs more than eight bits.
    const auto bytes = image_file_source(folder.write("b.pgm", "P5 2 1 255\n\x40\xff"), {Kind::gamma, 2});
    expect_shape(*bytes, 2, 1, 1, TexelKind::unsigned_16, false);
    EXPECT_EQ(values_of<uint16_t>(*bytes), (std::vector<uint16_t>{4128, 65535}));
}

TEST(ImageFileSource, FloatMapsFromTheirLastRowOn) {
    const support::TemporaryFolder folder;
    const auto gray = image_file_source(folder.write("a.pfm", "Pf\n2 2\n-2\n" + floats({3, 4, 1, 2})));
    expect_shape(*gray, 2, 2, 1, TexelKind::half, false);
    EXPECT_EQ(halves_of(*gray), (std::vector<float>{2, 4, 6, 8}));
    const auto color = image_file_source(folder.write("b.pfm", "PF 1 1 -1.0\n" + floats({NAN, 1e9f, -INFINITY})));
    EXPECT_EQ(halves_of(*color), (std::vector<float>{0, largest_half, -largest_half, 1}));
    std::string big_endian = "Pf 1 1 1\n" + floats({0.5f});
    std::reverse(big_endian.end() - 4, big_endian.end());
    EXPECT_EQ(halves_of(*image_file_source(folder.write("c.pfm", big_endian))), std::vector<float>{0.5f});
    EXPECT_EQ(halves_of(*image_file_source(folder.write("d.pfm", "Pf 1 1 -1\n" + floats({0.5f})), {Kind::gamma, 2})), std::vector<float>{0.25f});
}

TEST(ImageFileSource, LargeOnesComeInPieces) {
    const support::TemporaryFolder folder;
    std::string text = "P5 2000 1500 255\n";
    for (size_t i = 0; i < 3000000; i++) text += static_cast<char>(i * 7 / 3);
    const auto source = image_file_source(folder.write("a.pgm", text));
    size_t pieces = 0, largest = 0;
    std::string back;
    ASSERT_TRUE(source
                    ->read([&](std::span<const std::byte> rows) {
                        pieces++;
                        largest = std::max(largest, rows.size());
                        back.append(reinterpret_cast<const char*>(rows.data()), rows.size());
                        return Status();
                    })
                    .ok());
    EXPECT_GT(pieces, 2u);
    EXPECT_LE(largest, size_t{1} << 20);
    EXPECT_EQ(back, text.substr(17));
    EXPECT_EQ(source->read([](std::span<const std::byte>) { return Status::failed("enough"); }).message(), "enough");
}

TEST(ImageFileSource, DamagedFilesAreOneClearError) {
    const support::TemporaryFolder folder;
    std::filesystem::create_directory(folder / "folder.ppm");
    const std::pair<const char*, std::string> cases[] = {{"P5\n10 10\n255\nabc", "cut off"},
                                                         {"P6 1000000 1000000 255\n", "cut off"},
                                                         {"P6 1000000000 1000000000 255\n", "at most"},
                                                         {"P5 0 5 255\n", "empty"},
                                                         {"Pf 1048577 1 -1\n", "at most"},
                                                         {"P5 99999999999999999999999 1 255\n", "make no sense"},
                                                         {"P5 -5 1 255\n", "make no sense"},
                                                         {"P5 5 1 0\n", "make no sense"},
                                                         {"P5 5 1 65536\n", "make no sense"},
                                                         {"P5 5 1 2.5\n", "make no sense"},
                                                         {"PF 5 1 nan\n", "make no sense"},
                                                         {"PF 5 1 0\n", "make no sense"},
                                                         {"P5 5", "make no sense"},
                                                         {"P5", "make no sense"},
                                                         {"P5 # a comment without an end", "make no sense"},
                                                         {"", "is no binary PPM"},
                                                         {"P", "is no binary PPM"},
                                                         {"P3 1 1 255 1 2 3\n", "is no binary PPM"},
                                                         {"some text", "is no binary PPM"}};
    const auto expect_error = [&](const std::filesystem::path& path, const std::string& words) {
        const auto source = image_file_source(path);
        for (const Status& status : {source->shape().status(), source->read([](auto) { return Status(); })}) {
            ASSERT_FALSE(status.ok()) << words;
            EXPECT_TRUE(status.message().starts_with(path.string() + ": ")) << status.message();
            EXPECT_NE(status.message().find(words), std::string::npos) << status.message();
            EXPECT_EQ(status.message().find('\n'), std::string::npos);
        }
    };
    for (const auto& [text, words] : cases) expect_error(folder.write("bad.ppm", text), words);
    expect_error(folder / "folder.ppm", "is not a regular file");
    expect_error(folder / "missing.ppm", "");
    EXPECT_FALSE(image_file_source(folder / "missing.ppm")->fingerprint().ok());
    EXPECT_FALSE(image_file_source(folder.write("good.pgm", "P5 1 1 255\na"), {Kind::gamma, 0})->shape().ok());
}

TEST(ImageFileSource, FingerprintsTellFilesAndReadingsApart) {
    const support::TemporaryFolder folder;
    const std::filesystem::path path = folder.write("a.pgm", "P5 1 1 255\na");
    const auto fingerprint = [](const std::filesystem::path& file, const ImageEncoding& encoding = {}) {
        return *image_file_source(file, encoding)->fingerprint();
    };
    const uint64_t first = fingerprint(path);
    EXPECT_EQ(fingerprint(path), first);
    EXPECT_NE(fingerprint(path, {Kind::linear, 1}), first);
    EXPECT_NE(fingerprint(path, {Kind::gamma, 2}), fingerprint(path, {Kind::gamma, 3}));
    EXPECT_NE(fingerprint(folder.write("b.pgm", "P5 1 1 255\na")), first);
    folder.write("a.pgm", "P5 2 1 255\nab");
    EXPECT_NE(fingerprint(path), first);
}

TEST(MemoryImageSource, IsWhatItWasMadeOf) {
    const ImageShape shape{2, 1, 1, TexelKind::unsigned_16, false};
    const auto image = memory_image("ramp", shape, {std::byte{1}, std::byte{2}, std::byte{3}, std::byte{4}});
    EXPECT_EQ(image->name(), "ramp");
    expect_shape(*image, 2, 1, 1, TexelKind::unsigned_16, false);
    EXPECT_EQ(values_of<uint16_t>(*image), (std::vector<uint16_t>{0x201, 0x403}));
    const auto other = memory_image("ramp", {1, 2, 1, TexelKind::unsigned_16, false}, {std::byte{1}, std::byte{2}, std::byte{3}, std::byte{4}});
    EXPECT_NE(*image->fingerprint(), *other->fingerprint());
}

}  // namespace
}  // namespace raypager
