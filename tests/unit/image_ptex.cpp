// Ptex files, and the image on which their faces lie.
#include <gtest/gtest.h>

#include <map>
#include <random>

#include "base/half.hpp"
#include "image/ptex_atlas.hpp"
#include "support/ptex_writer.hpp"
#include "support/temporary_folder.hpp"
#include "support/thorough.hpp"

namespace raypager {
namespace {

using support::PtexEncoding;
using support::PtexFace;
using support::PtexSettings;
using support::PtexWriter;
using support::TemporaryFolder;

// Of all encodings and shapes.
std::vector<PtexFace> many_faces() {
    std::vector<PtexFace> faces;
    for (uint8_t w = 0; w < 6; w++)
        for (uint8_t h = 0; h < 6; h++) {
            if (w == 0 && h == 0) continue;
            faces.push_back({w, h, w % 2 ? PtexEncoding::zipped : PtexEncoding::differences});
            if (w > 1 && h > 1) faces.push_back({w, h, PtexEncoding::tiled});
        }
    faces.push_back({3, 3, PtexEncoding::constant});
    faces.push_back({4, 2, PtexEncoding::zipped, true});
    faces.push_back({0, 0, PtexEncoding::constant, true});
    return faces;
}

// Of faces that are constant, the same everywhere.
uint32_t mixed_bits(const std::vector<PtexFace>& faces, uint32_t f, uint32_t x, uint32_t y, uint32_t c) {
    if (faces[f].is_constant || faces[f].encoding == PtexEncoding::constant) x = y = 0;
    return (f * 2654435761u ^ x * 40503u ^ y * 30011u ^ c * 977u) * 2246822519u >> 7;
}

TEST(Ptex, EveryTexelOfEveryEncodingIsRead) {
    const TemporaryFolder folder;
    const std::vector<PtexFace> faces = many_faces();
    const auto value = [&](uint32_t f, uint32_t x, uint32_t y, uint32_t c) { return mixed_bits(faces, f, x, y, c); };
    for (uint32_t type = 0; type < 4; type++)
        for (const uint16_t channels : {1, 2, 3, 4, 5})
            for (const int32_t alpha : {-1, 3}) {
                const PtexSettings settings = {type, channels, alpha};
                const auto file = PtexFile::open(folder.write("a.ptx", PtexWriter::write(settings, faces, value)));
                ASSERT_TRUE(file.ok()) << file.status().message();
                const size_t bytes = bytes_of_stored((*file)->kind());
                ASSERT_EQ((*file)->faces().size(), faces.size());
                ASSERT_EQ((*file)->channels(), channels < 3 ? 1u : channels > 3 && alpha == 3 ? 4u : 3u);
                for (uint32_t f = 0; f < faces.size(); f++) {
                    std::vector<std::byte> texels;
                    ASSERT_TRUE((*file)->read_face(f, texels).ok());
                    const auto [w, h] = (*file)->faces()[f];
                    ASSERT_EQ(w, faces[f].is_constant ? 0 : faces[f].log_width);
                    ASSERT_EQ(texels.size(), (bytes * (*file)->channels()) << (w + h));
                    size_t at = 0;
                    for (uint32_t y = 0; y < 1u << h; y++)
                        for (uint32_t x = 0; x < 1u << w; x++)
                            for (uint32_t c = 0; c < (*file)->channels(); c++, at += bytes) {
                                const uint32_t expected = value(f, x, y, c);
                                ASSERT_EQ(std::memcmp(&texels[at], &expected, bytes), 0) << "face " << f << " at " << x << ' ' << y;
                            }
                }
            }
}

// Every place of a face is on a texel of its own, and the corners are the texels there.
TEST(Ptex, FacesLieSideBySideOnOneImage) {
    const TemporaryFolder folder;
    const std::vector<PtexFace> faces = many_faces();
    const auto value = [&](uint32_t f, uint32_t x, uint32_t y, uint32_t c) { return mixed_bits(faces, f, x, y, c); };
    const auto file = PtexFile::open(folder.write("a.ptx", PtexWriter::write({0, 3}, faces, value)));
    ASSERT_TRUE(file.ok());
    const auto atlas = PtexAtlas::create(*file, {ImageEncoding::Kind::linear, 1});
    ASSERT_TRUE(atlas.ok()) << atlas.status().message();
    const ImageShape shape = *(*atlas)->shape();
    ASSERT_EQ(shape.channels, 4u);
    ASSERT_EQ(shape.kind, TexelKind::unsigned_8);
    std::vector<std::byte> texels;
    ASSERT_TRUE((*atlas)
                    ->read([&](std::span<const std::byte> rows) {
                        texels.insert(texels.end(), rows.begin(), rows.end());
                        return Status();
                    })
                    .ok());
    ASSERT_EQ(texels.size(), size_t{shape.width} * shape.height * 4);
    std::map<size_t, uint32_t> owners;
    size_t used = 0;
    for (uint32_t f = 0; f < faces.size(); f++) {
        const auto [w, h] = (*file)->faces()[f];
        for (uint32_t y = 0; y < 1u << h; y++)
            for (uint32_t x = 0; x < 1u << w; x++, used++) {
                const Float2 place = (*atlas)->place(f, w == 0 ? 0.3 : x / ((1u << w) - 1.0), h == 0 ? 0.3 : y / ((1u << h) - 1.0));
                const auto column = static_cast<size_t>(place.x * static_cast<float>(shape.width));
                const auto row = static_cast<size_t>(place.y * static_cast<float>(shape.height));
                ASSERT_TRUE(column < shape.width && row < shape.height);
                const size_t at = row * shape.width + column;
                ASSERT_TRUE(owners.try_emplace(at, f).second) << "face " << f << " lies over face " << owners[at];
                for (uint32_t c = 0; c < 3; c++)
                    ASSERT_EQ(std::to_integer<uint32_t>(texels[4 * at + c]), value(f, x, y, c) & 255u) << "face " << f << " at " << x << ' ' << y;
            }
    }
    EXPECT_LT(size_t{shape.width} * shape.height, 4 * used) << "most of the image is empty";
    EXPECT_EQ((*atlas)->place(faces.size(), 0.25, 0.5), (*atlas)->place(0, 0.25, 0.5)) << "what is no face is the first";
    const auto same = PtexAtlas::create(*file, {ImageEncoding::Kind::gamma, 2.2f});
    ASSERT_TRUE(same.ok());
    EXPECT_TRUE((*same)->lies_like(**atlas));
    EXPECT_EQ((*same)->shape()->kind, TexelKind::unsigned_16) << "gamma comes as linear";
    EXPECT_NE(*(*same)->fingerprint(), *(*atlas)->fingerprint());
}

TEST(Ptex, WhatIsDamagedIsOneClearError) {
    const TemporaryFolder folder;
    const std::vector<PtexFace> faces = many_faces();
    const auto value = [&](uint32_t f, uint32_t x, uint32_t y, uint32_t c) { return mixed_bits(faces, f, x, y, c); };
    const std::string good = PtexWriter::write({0, 3}, faces, value);
    // Reads all that can be read. True if nothing was found wrong.
    const auto reads = [&](const std::string& bytes) {
        const auto file = PtexFile::open(folder.write("b.ptx", bytes));
        if (!file) {
            EXPECT_NE(file.status().message().find("b.ptx: "), std::string::npos) << file.status().message();
            return false;
        }
        const auto atlas = PtexAtlas::create(*file, {ImageEncoding::Kind::linear, 1});
        return atlas.ok() && (*atlas)->read([](std::span<const std::byte>) { return Status(); }).ok();
    };
    EXPECT_TRUE(reads(good));
    for (size_t length = 0; length < good.size(); length += 1 + length / 16) EXPECT_FALSE(reads(good.substr(0, length))) << length;
    std::mt19937 random(11);
    size_t noticed = 0;
    const size_t trials = support::thorough() ? 400 : 100;
    for (size_t i = 0; i < trials; i++) {
        std::string bad = good;
        const size_t at = i < trials / 2 ? random() % 64 : random() % bad.size();
        bad[at] = static_cast<char>(bad[at] ^ 1 << random() % 8);
        noticed += !reads(bad);
    }
    EXPECT_GT(noticed, trials / 2);
    EXPECT_FALSE(reads(PtexWriter::write({0, 3, -1, 0}, faces, value))) << "triangles";
    EXPECT_FALSE(reads(PtexWriter::write({0, 3}, {{26, 26, PtexEncoding::constant}}, value))) << "too many texels";
}

}  // namespace
}  // namespace raypager
