// The mean of many lookups on the device against what OpenImageIO's texture system filters: bilinear within a level, on the levels that a filter as
// wide as one of their texels takes. The images are squares of a power of two: of other sizes OpenImageIO makes levels from other areas, and it takes
// the width along each axis for a filter of its own. Between levels it blends by the width itself, not by its logarithm, so that is compared nowhere.
#include <OpenImageIO/imageio.h>
#include <OpenImageIO/texture.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <random>

#include "raypager/image_source.hpp"
#include "raypager/picture.hpp"
#include "support/temporary_folder.hpp"
#include "support/texture_probe.hpp"

namespace raypager {
namespace {

constexpr uint32_t image_size = 256, image_levels = 9;

// Smooth, but for a few texels that stand out; red, green and blue differ.
std::string write_image(const std::filesystem::path& path, OIIO::TypeDesc type) {
    std::vector<float> values;
    std::mt19937 random(3);
    for (uint32_t y = 0; y < image_size; y++)
        for (uint32_t x = 0; x < image_size; x++)
            for (uint32_t c = 0; c < 3; c++) {
                const double u = (x + 0.5) / image_size, v = (y + 0.5) / image_size;
                values.push_back(static_cast<float>(random() % 50 == 0 ? 1 : 0.5 + 0.2 * std::sin(7 * u + c) + 0.2 * std::cos(9 * v - 4 * u * c)));
            }
    OIIO::ImageSpec spec(image_size, image_size, 3, type);
    spec.attribute("oiio:ColorSpace", "Linear");
    const auto out = OIIO::ImageOutput::create(path.string());
    if (!out || !out->open(path.string(), spec) || !out->write_image(OIIO::TypeDesc::FLOAT, values.data()))
        throw std::runtime_error(OIIO::geterror());
    out->close();
    return path.string();
}

struct FilteredLookup {
    uint32_t image, op;
    float s, t, width;
    uint32_t samples, unused[2] = {};
};

class OpenImageIOTextures {
public:
    // The one that all of a process share, which stays to its end: version 2.4 gives one of its own back as what it is not (AddressSanitizer).
    OpenImageIOTextures() : system_(OIIO::TextureSystem::create(true)) { system_->attribute("automip", 1); }

    std::array<float, 3> look_up(const std::string& file, const FilteredLookup& l) {
        using Wrap = OIIO::TextureOpt::Wrap;
        constexpr Wrap wraps[] = {OIIO::TextureOpt::WrapPeriodic, OIIO::TextureOpt::WrapBlack, OIIO::TextureOpt::WrapClamp,
                                  OIIO::TextureOpt::WrapMirror};
        OIIO::TextureOpt options;
        options.swrap = wraps[l.op >> RP_TEXTURE_WRAP_SHIFT & 3];
        options.twrap = wraps[l.op >> (RP_TEXTURE_WRAP_SHIFT + 2) & 3];
        options.mipmode = OIIO::TextureOpt::MipModeTrilinear;
        options.interpmode = OIIO::TextureOpt::InterpBilinear;
        std::array<float, 3> found = {};
        if (!system_->texture(OIIO::ustring(file), options, l.s, l.t, l.width, 0, 0, l.width, 3, found.data()))
            throw std::runtime_error(system_->geterror());
        return found;
    }

private:
    OIIO::TextureSystem* const system_;
};

TEST(TextureFilter, TheMeanOfLookupsIsWhatOpenImageIOFilters) {
    use_openimageio();
    const support::TemporaryFolder folder;
    const std::vector<std::string> files = {write_image(folder / "bytes.tif", OIIO::TypeDesc::UINT8),
                                            write_image(folder / "words.tif", OIIO::TypeDesc::UINT16),
                                            write_image(folder / "halves.exr", OIIO::TypeDesc::HALF)};
    Scene scene;
    for (const std::string& file : files) scene.images.push_back(image_file_source(file, {ImageEncoding::Kind::linear, 1}));
    support::TextureProbe probe(scene);
    std::mt19937 random(7);
    std::uniform_real_distribution<float> place(-1, 2);
    std::vector<FilteredLookup> lookups;
    for (uint32_t i = 0; i < 600; i++) {
        // Level 0 from near, where one texel is larger than the filter, and all others.
        const int level = static_cast<int>(i % (image_levels + 1)) - 1;
        lookups.push_back({static_cast<uint32_t>(i % files.size()), static_cast<uint32_t>(random() % 16) << RP_TEXTURE_WRAP_SHIFT, place(random),
                           place(random), std::ldexp(1.0f / image_size, level), 4096});
    }
    const auto means = probe.run<std::array<float, 4>>("rp_probe_means", lookups, lookups.size());
    OpenImageIOTextures judge;
    double worst = 0, squares = 0;
    for (size_t i = 0; i < lookups.size(); i++) {
        const auto expected = judge.look_up(files[lookups[i].image], lookups[i]);
        for (size_t c = 0; c < 3; c++) {
            const double off = std::abs(means[i][c] - expected[c]);
            // Texels differ by 1 at most: what random numbers leave of 4096 lookups; and a level is rounded to bytes before the next is made of it.
            EXPECT_LE(off, 0.01) << files[lookups[i].image] << " at " << lookups[i].s << ' ' << lookups[i].t << ", width " << lookups[i].width
                                 << ", wraps " << (lookups[i].op >> RP_TEXTURE_WRAP_SHIFT) << ", channel " << c << ": " << means[i][c] << ' '
                                 << expected[c];
            worst = std::max(worst, off);
            squares += off * off;
        }
    }
    std::printf("off by %.4f at most, by %.5f in the root mean square\n", worst, std::sqrt(squares / (3.0 * static_cast<double>(lookups.size()))));
}

}  // namespace
}  // namespace raypager
