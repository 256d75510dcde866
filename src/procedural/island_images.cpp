#include "procedural/island_images.hpp"

#include <algorithm>
#include <cmath>

#include "procedural/noise.hpp"

namespace raypager {
namespace {

constexpr Paint deep_sea = {18, 53, 76};  // open_water in sRGB

// Something seen from above, pixel by pixel along the axes of the land.
class MapPainter : public ImagePainter {
public:
    MapPainter(const IslandLand& land, uint32_t size, uint64_t seed) : ImagePainter(size, size), land_(land), seed_(mix_bits(seed)) {
        for (uint32_t x = 0; x < size; x++) columns_.push_back(land.axis_x().at((x + 0.5) / size));
    }
    void row(uint32_t y, std::span<uint8_t> bytes) override {
        const double z = land_.axis_z().at(1 - down(y));
        for (uint32_t x = 0; x < width(); x++) {
            const Paint c = color(columns_[x], z);
            bytes[3 * size_t{x}] = quantized(c.r);
            bytes[3 * size_t{x} + 1] = quantized(c.g);
            bytes[3 * size_t{x} + 2] = quantized(c.b);
        }
    }

protected:
    virtual Paint color(double x, double z) const = 0;
    // -1 to 1, with features of about so many metres.
    double patches(double x, double z, double metres, int octaves, uint64_t number) const {
        return fractal_noise({x / metres, 0.3, z / metres}, octaves, 0.55, seed_ + number);
    }
    const IslandLand& land_;
    const uint64_t seed_;

private:
    std::vector<double> columns_;
};

class GroundPainter final : public MapPainter {
public:
    using MapPainter::MapPainter;

private:
    Paint color(double x, double z) const override {
        const double d = land_.inland(x, z);
        const IslandLand::Footing at = land_.footing(x, z);
        const auto fine = static_cast<float>(patches(x, z, 0.7, 3, 1)), coarse = static_cast<float>(patches(x, z, 14, 4, 2));
        const Paint sand =
            lit(blended({164, 140, 100}, {232, 212, 170}, static_cast<float>(smooth_step(0.3, 3.5, d + 0.8 * coarse))), 1 + 0.10f * fine);
        const Paint turf = lit(blended({70, 92, 38}, {112, 128, 52}, 0.5f + coarse), 1 + 0.25f * fine);
        const Paint rock = lit(blended({84, 76, 66}, {74, 88, 50}, std::clamp(0.5f + 1.2f * coarse, 0.0f, 1.0f)), 1 + 0.3f * fine);
        const double bare = smooth_step(0.80, 0.62, at.normal[1] + 0.15 * coarse);
        const double grown = smooth_step(0.75, 1.25, d / land_.beach() + 0.25 * coarse + 0.1 * fine);
        return blended(sand, blended(turf, rock, static_cast<float>(bare)), static_cast<float>(grown));
    }
};

class WaterPainter final : public MapPainter {
public:
    using MapPainter::MapPainter;

private:
    Paint color(double x, double z) const override {
        const double out = -land_.inland(x, z), wide = 0.12 * land_.radius();
        const double wander = 0.2 * patches(x, z, 0.2 * land_.radius(), 4, 3);
        const double off = std::max(0.0, out / wide * (1 + wander));
        Paint c = blended({176, 208, 178}, {70, 178, 168}, static_cast<float>(smooth_step(0, 0.12, off)));
        c = blended(c, {28, 122, 138}, static_cast<float>(smooth_step(0.1, 0.55, off)));
        c = blended(c, deep_sea, static_cast<float>(smooth_step(0.45, 1.3, off)));
        const double reef = smooth_step(0.12, 0.35, patches(x, z, 9, 4, 5)) * smooth_step(0.08, 0.2, off) * smooth_step(0.9, 0.5, off);
        c = blended(c, {34, 84, 78}, static_cast<float>(0.55 * reef));
        const double wash = out - 0.7 - 1.2 * patches(x, z, 3.5, 4, 7);  // foam where waves run out
        const double foam = smooth_step(1.5, 0.2, std::abs(wash)) * smooth_step(-0.3, 0.25, patches(x, z, 0.6, 3, 9));
        const double edge = smooth_step(0.98, 0.9, std::max(std::abs(x), std::abs(z)) / land_.half());
        return blended(deep_sea, blended(c, {244, 248, 244}, static_cast<float>(0.9 * foam)), static_cast<float>(edge));
    }
};

class MaskPainter : public ImagePainter {
public:
    using ImagePainter::ImagePainter;
    uint32_t channels() const override { return 1; }
    void row(uint32_t y, std::span<uint8_t> bytes) override {
        for (uint32_t x = 0; x < width(); x++) bytes[x] = covers(2 * (x + 0.5) / width() - 1, 1 - down(y)) ? 255 : 0;
    }

protected:
    virtual bool covers(double u, double v) const = 0;  // u from -1 to 1 across, v from 0 to 1 up
};

// A stalk with narrow leaflets on both sides, longest at a third of its length.
class FrondMask final : public MaskPainter {
public:
    using MaskPainter::MaskPainter;

private:
    bool covers(double u, double v) const override {
        const double side = std::abs(u);
        if (side < 0.04) return v < 0.98;
        const double half = v < 0.35 ? 0.35 + 0.6 * v / 0.35 : 0.95 * (1 - v) / 0.65;
        if (side > half || v < 0.06) return false;
        const double place = (v - 0.1 * side) * 26, in_leaflet = place - std::floor(place);
        return std::abs(in_leaflet - 0.5) < 0.42 * (1 - 0.75 * side / half);
    }
};

// Five round petals.
class FlowerMask final : public MaskPainter {
public:
    explicit FlowerMask(uint32_t size) : MaskPainter(size, size) {}

private:
    bool covers(double u, double v) const override {
        const double w = 2 * v - 1;
        for (int i = 0; i < 5; i++) {
            const SinCos at = sincos_turns(i / 5.0);
            const double x = u - 0.52 * at.sin, y = w - 0.52 * at.cos;
            if (x * x + y * y < 0.44 * 0.44) return true;
        }
        return false;
    }
};

Vector equal_area_direction(double u, double v) {
    const double x = 2 * u - 1, y = 2 * v - 1;
    const double inside = 1 - (std::abs(x) + std::abs(y)), r = 1 - std::abs(inside);
    const SinCos turn = sincos_turns((r == 0 ? 1 : (std::abs(y) - std::abs(x)) / r + 1) / 8);
    const double beside = r * std::sqrt(2 - r * r);
    return {std::copysign(turn.cos * beside, x), std::copysign(turn.sin * beside, y), std::copysign(1 - r * r, inside)};
}

// Of a world with y up.
Vector sky_radiance(const Vector& d, const Vector& to_sun, uint64_t seed) {
    constexpr Vector zenith = {0.10, 0.25, 0.62}, horizon = {0.62, 0.76, 0.90}, cloud = {1.05, 1.0, 0.95};
    const double up = std::max(0.0, d[1]), low = (1 - up) * (1 - up) * (1 - up) * (1 - up);
    Vector c = zenith * (1 - low) + horizon * low;
    const double towards = std::max(0.0, dot(d, to_sun)), glow = towards * towards * towards * towards;
    c = c + Vector{0.55, 0.36, 0.18} * (glow * (0.35 + glow * glow * glow));
    const double above = std::max(d[1], 0.0) + 0.12;
    const double puffs = fractal_noise({1.1 * d[0] / above, 0.2, 1.1 * d[2] / above}, 6, 0.55, seed);
    const double cover = smooth_step(0.06, 0.42, puffs) * smooth_step(0.01, 0.14, d[1]) * 0.85;
    c = c * (1 - cover) + cloud * ((0.75 + 0.35 * glow) * cover);
    return d[1] < 0 ? c * 0.5 : c;
}

}  // namespace

std::unique_ptr<ImagePainter> paint_ground(const IslandLand& land, uint32_t size, uint64_t seed) {
    return std::make_unique<GroundPainter>(land, size, seed + 1);
}
std::unique_ptr<ImagePainter> paint_water(const IslandLand& land, uint32_t size, uint64_t seed) {
    return std::make_unique<WaterPainter>(land, size, seed + 2);
}
std::unique_ptr<ImagePainter> paint_frond_mask(uint32_t width, uint32_t height) { return std::make_unique<FrondMask>(width, height); }
std::unique_ptr<ImagePainter> paint_flower_mask(uint32_t size) { return std::make_unique<FlowerMask>(size); }

Image paint_sky(uint32_t size, const Vector& to_sun, uint64_t seed) {
    Image sky{size, size, 3, {}};
    sky.values.reserve(size_t{3} * size * size);
    for (uint32_t y = 0; y < size; y++)
        for (uint32_t x = 0; x < size; x++) {
            const Vector d = equal_area_direction((x + 0.5) / size, (y + 0.5) / size);
            for (const double value : sky_radiance({d[0], d[2], -d[1]}, to_sun, mix_bits(seed + 77))) sky.values.push_back(static_cast<float>(value));
        }
    return sky;
}

}  // namespace raypager
