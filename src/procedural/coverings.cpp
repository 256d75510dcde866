#include "procedural/coverings.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/check.hpp"

namespace raypager {
namespace {

// Of numbers small enough for an int; std::floor would be a call for each texel.
float fraction(float x) {
    const float rest = x - static_cast<float>(static_cast<int>(x));
    return rest < 0 ? rest + 1 : rest;
}

class ColorCovering : public ImagePainter {
public:
    ColorCovering(uint32_t width, uint32_t height, uint64_t seed) : ImagePainter(width, height), random_(seed, 5), seed_(seed) {}

protected:
    Random random_;
    const uint64_t seed_;
    float across(uint32_t x) const { return (static_cast<float>(x) + 0.5f) / static_cast<float>(width()); }
    static void put(std::span<uint8_t> bytes, uint32_t x, const Paint& c, uint32_t grain) {
        const float dust = static_cast<float>(grain) * (8.0f / 256) - 4;
        bytes[3 * size_t{x}] = quantized(c.r + dust);
        bytes[3 * size_t{x} + 1] = quantized(c.g + dust);
        bytes[3 * size_t{x} + 2] = quantized(c.b + dust);
    }
};

class GreyCovering : public ImagePainter {
public:
    GreyCovering(uint32_t width, uint32_t height, uint64_t seed) : ImagePainter(width, height), random_(seed, 5), seed_(seed) {}
    uint32_t channels() const override { return 1; }

protected:
    Random random_;
    const uint64_t seed_;
};

// Square tiles with joints between them.
constexpr uint32_t tiles_a_side = 6;
struct TileRow {
    TileRow(uint32_t y, uint32_t height) {
        const uint64_t position = uint64_t{y} * tiles_a_side * 1024 / height;
        row = static_cast<uint32_t>(position / 1024);
        joint = is_joint(static_cast<uint32_t>(position % 1024));
    }
    static bool is_joint(uint32_t in_tile) { return in_tile < 10 || in_tile >= 1014; }
    uint32_t row;
    bool joint;
};
struct TileColumn {
    TileColumn(uint32_t x, uint32_t width) {
        const uint32_t position = x * (tiles_a_side * 1024) / width;  // 16384 * 6144 fits
        column = position / 1024;
        joint = TileRow::is_joint(position % 1024);
    }
    uint32_t column;
    bool joint;
};

class Tiles final : public ColorCovering {
public:
    Tiles(uint32_t width, uint32_t height, uint64_t seed)
        : ColorCovering(width, height, seed), veins_(noise_shape(9, 9, 5), seed + 1), cloud_(noise_shape(14, 14, 3), seed + 2) {
        for (uint32_t i = 0; i < colors_.size(); i++) {
            const bool dark = (i / tiles_a_side + i) % 2 == 1;
            colors_[i] = lit(dark ? Paint{112, 92, 76} : Paint{206, 194, 172}, static_cast<float>(random_.uniform(0.9, 1.06)));
        }
    }
    void row(uint32_t y, std::span<uint8_t> bytes) override {
        const TileRow tile(y, height());
        const std::span<const float> vein = veins_.row(y), cloud = cloud_.row(y);
        const RowGrain grain(y, seed_);
        for (uint32_t x = 0; x < width(); x++) {
            const TileColumn at(x, width());
            Paint c = lit(colors_[tile.row * tiles_a_side + at.column], 1 + 0.22f * cloud[x]);
            const float ridge = std::max(0.0f, 1 - 9 * std::abs(vein[x]));
            c = blended(c, {232, 226, 214}, 0.5f * ridge * ridge);
            if (tile.joint || at.joint) c = {70, 64, 58};
            put(bytes, x, c, grain(x));
        }
    }

private:
    std::array<Paint, tiles_a_side * tiles_a_side> colors_{};
    RowNoise veins_, cloud_;
};

// How rough they are: polished, worn along where people walk, rough at the joints.
class WornTiles final : public GreyCovering {
public:
    WornTiles(uint32_t width, uint32_t height, uint64_t seed) : GreyCovering(width, height, seed), wear_(noise_shape(6, 6, 6), seed + 1) {}
    void row(uint32_t y, std::span<uint8_t> bytes) override {
        const TileRow tile(y, height());
        const std::span<const float> wear = wear_.row(y);
        const RowGrain grain(y, seed_);
        for (uint32_t x = 0; x < width(); x++) {
            const TileColumn at(x, width());
            const float rough = 46 + 120 * std::max(0.0f, wear[x] + 0.05f) + static_cast<float>((at.column * 5 + tile.row * 3) % 4) * 8;
            bytes[x] = quantized(tile.joint || at.joint ? 190 : rough + static_cast<float>(grain(x) >> 5));
        }
    }

private:
    RowNoise wear_;
};

// A painted wall with a faint pattern of lozenges.
class Plaster final : public ColorCovering {
public:
    Plaster(uint32_t width, uint32_t height, uint64_t seed) : ColorCovering(width, height, seed), stain_(noise_shape(5, 5, 5), seed + 1) {
        constexpr std::array<uint32_t, 4> walls = {0x8e3b38, 0x4f6b58, 0x44617b, 0xb08d4f};
        color_ = paint_of(walls[random_.below(walls.size())]);
    }
    void row(uint32_t y, std::span<uint8_t> bytes) override {
        const std::span<const float> stain = stain_.row(y);
        const float v = std::abs(fraction(static_cast<float>(8 * down(y))) - 0.5f);
        const RowGrain grain(y, seed_);
        for (uint32_t x = 0; x < width(); x++) {
            const float d = v + std::abs(fraction(8 * across(x)) - 0.5f);
            const float pattern = d > 0.47f && d < 0.53f ? 0.12f : d < 0.14f ? 0.1f : 0.0f;
            put(bytes, x, lit(color_, 1 + 0.16f * stain[x] + pattern), grain(x));
        }
    }

private:
    Paint color_;
    RowNoise stain_;
};

// Boards along y, each of its own tree.
class Planks final : public ColorCovering {
public:
    Planks(uint32_t width, uint32_t height, uint64_t seed)
        : ColorCovering(width, height, seed), grain_(noise_shape(40, 2, 5), seed + 1), bend_(noise_shape(6, 3, 3), seed + 2) {
        const float tone = static_cast<float>(random_.uniform(0.8, 1.15));
        for (Paint& board : boards_) board = lit({148, 104, 62}, tone * static_cast<float>(random_.uniform(0.82, 1.12)));
    }
    void row(uint32_t y, std::span<uint8_t> bytes) override {
        const std::span<const float> fibre = grain_.row(y), bend = bend_.row(y);
        const RowGrain grain(y, seed_);
        for (uint32_t x = 0; x < width(); x++) {
            const float at = across(x) * boards_.size(), in_board = fraction(at);
            const Paint& board = boards_[std::min(static_cast<size_t>(at), boards_.size() - 1)];
            const float ring = std::abs(fraction(4 * in_board + 2.5f * bend[x]) - 0.5f);
            const float seam = in_board < 0.03f || in_board > 0.97f ? 0.45f : 1.0f;
            put(bytes, x, lit(board, seam * (0.86f + 0.3f * ring + 0.4f * fibre[x])), grain(x));
        }
    }

private:
    std::array<Paint, 5> boards_{};
    RowNoise grain_, bend_;
};

class Marble final : public ColorCovering {
public:
    Marble(uint32_t width, uint32_t height, uint64_t seed)
        : ColorCovering(width, height, seed), veins_(noise_shape(4, 6, 6), seed + 1), fine_(noise_shape(11, 9, 4), seed + 2) {
        constexpr std::array<std::array<uint32_t, 2>, 7> stones = {{{0xe6e0d6, 0x7d7870},
                                                                    {0xd8c9ae, 0x8a6a48},
                                                                    {0x55705f, 0xc6d2c4},
                                                                    {0xa8665a, 0xe7d3c6},
                                                                    {0x34363c, 0xb9b4aa},
                                                                    {0xc8b7b0, 0x6b4d4a},
                                                                    {0x8793a3, 0xe4e6e6}}};
        const auto& stone = stones[random_.below(stones.size())];
        ground_ = paint_of(stone[0]);
        vein_ = paint_of(stone[1]);
    }
    void row(uint32_t y, std::span<uint8_t> bytes) override {
        const std::span<const float> n = veins_.row(y), fine = fine_.row(y);
        const RowGrain grain(y, seed_);
        for (uint32_t x = 0; x < width(); x++) {
            const float wide = std::max(0.0f, 1 - 5 * std::abs(n[x])), thin = std::max(0.0f, 1 - 14 * std::abs(fine[x] + 0.3f * n[x]));
            put(bytes, x, lit(blended(ground_, vein_, 0.75f * wide * wide * wide + 0.35f * thin), 1 + 0.12f * fine[x]), grain(x));
        }
    }

private:
    Paint ground_, vein_;
    RowNoise veins_, fine_;
};

class Clay final : public ColorCovering {
public:
    Clay(uint32_t width, uint32_t height, uint64_t seed) : ColorCovering(width, height, seed), noise_(noise_shape(5, 24, 5), seed + 1) {}
    void row(uint32_t y, std::span<uint8_t> bytes) override {
        const std::span<const float> n = noise_.row(y);
        const RowGrain grain(y, seed_);
        const float band = std::abs(fraction(static_cast<float>(3 * down(y))) - 0.5f) < 0.06f ? 0.8f : 1.0f;
        for (uint32_t x = 0; x < width(); x++) put(bytes, x, lit({176, 98, 64}, band * (1 + 0.35f * n[x])), grain(x));
    }

private:
    RowNoise noise_;
};

// What a kind of plant's leaf looks like. It grows from the bottom of the image; u runs from -1 to 1 across it, v from 0 to 1 up.
class LeafShape {
public:
    explicit LeafShape(uint64_t seed) {
        Random random(seed, 6);
        kind_ = random.below(4);
        widest_ = static_cast<float>(random.uniform(0.3, 0.55));
        teeth_ = static_cast<float>(7 + random.below(8));
        slope_ = static_cast<float>(random.uniform(0.15, 0.35));
    }
    // Half its width at v.
    float half_width(float v) const {
        const float t = v < widest_ ? v / widest_ : (1 - v) / (1 - widest_);
        return 0.96f * t * (2 - t);
    }
    float along(float u, float v) const { return v - slope_ * std::abs(u); }  // along the veins
    float teeth() const { return teeth_; }
    bool covers(float u, float v, float half) const {
        const float side = std::abs(u);
        if (side < 0.035f) return v < 0.97f;  // the stalk and midrib
        if (side > half) return false;
        const float tooth = fraction(along(u, v) * teeth_);
        switch (kind_) {
            case 0:
                return true;
            case 1:
                return side < half * (0.8f + 0.2f * tooth);  // saw
            case 2:
                return tooth < 0.62f || side < 0.25f * half;  // fingers, as of a fern
            default:
                return tooth < 0.8f || side < 0.55f * half;  // split near the border
        }
    }

private:
    uint32_t kind_;
    float widest_, teeth_, slope_;
};

class Leaf final : public ColorCovering {
public:
    Leaf(uint32_t width, uint32_t height, uint64_t seed) : ColorCovering(width, height, seed), shape_(seed), spots_(noise_shape(7, 12, 4), seed + 1) {
        constexpr std::array<uint32_t, 5> greens = {0x3f7a3a, 0x5e8c31, 0x2f6b4f, 0x86a545, 0x476b2a};
        color_ = paint_of(greens[random_.below(greens.size())]);
    }
    void row(uint32_t y, std::span<uint8_t> bytes) override {
        const auto v = static_cast<float>(1 - down(y));
        const std::span<const float> spots = spots_.row(y);
        const RowGrain grain(y, seed_);
        for (uint32_t x = 0; x < width(); x++) {
            const float u = 2 * across(x) - 1, vein = fraction(shape_.along(u, v) * 2 * shape_.teeth());
            Paint c = lit(color_, 1.05f - 0.35f * std::abs(u) + 0.3f * spots[x]);
            if (std::abs(u) < 0.05f || vein < 0.12f) c = blended(c, {196, 206, 130}, 0.45f);
            put(bytes, x, c, grain(x));
        }
    }

private:
    LeafShape shape_;
    Paint color_;
    RowNoise spots_;
};

class LeafMask final : public GreyCovering {
public:
    LeafMask(uint32_t width, uint32_t height, uint64_t seed) : GreyCovering(width, height, seed), shape_(seed) {}
    void row(uint32_t y, std::span<uint8_t> bytes) override {
        const auto v = static_cast<float>(1 - down(y));
        const float half = shape_.half_width(v), unit = 2 / static_cast<float>(width());
        for (uint32_t x = 0; x < width(); x++) bytes[x] = shape_.covers((static_cast<float>(x) + 0.5f) * unit - 1, v, half) ? 255 : 0;
    }

private:
    LeafShape shape_;
};

// Roughness with marks of a brush along x.
class Brushed final : public GreyCovering {
public:
    Brushed(uint32_t width, uint32_t height, uint64_t seed)
        : GreyCovering(width, height, seed), marks_(noise_shape(3, 60, 4), seed + 1), wear_(noise_shape(7, 7, 4), seed + 2) {
        base_ = static_cast<float>(random_.uniform(50, 130));
    }
    void row(uint32_t y, std::span<uint8_t> bytes) override {
        const std::span<const float> marks = marks_.row(y), wear = wear_.row(y);
        const RowGrain grain(y, seed_);
        for (uint32_t x = 0; x < width(); x++) bytes[x] = quantized(base_ + 90 * marks[x] + 70 * wear[x] + static_cast<float>(grain(x) >> 4));
    }

private:
    float base_ = 90;
    RowNoise marks_, wear_;
};

}  // namespace

std::unique_ptr<ImagePainter> make_covering(Covering covering, uint32_t width, uint32_t height, uint64_t seed) {
    switch (covering) {
        case Covering::tiles:
            return std::make_unique<Tiles>(width, height, seed);
        case Covering::worn_tiles:
            return std::make_unique<WornTiles>(width, height, seed);
        case Covering::plaster:
            return std::make_unique<Plaster>(width, height, seed);
        case Covering::planks:
            return std::make_unique<Planks>(width, height, seed);
        case Covering::marble:
            return std::make_unique<Marble>(width, height, seed);
        case Covering::clay:
            return std::make_unique<Clay>(width, height, seed);
        case Covering::leaf:
            return std::make_unique<Leaf>(width, height, seed);
        case Covering::leaf_mask:
            return std::make_unique<LeafMask>(width, height, seed);
        case Covering::brushed:
            return std::make_unique<Brushed>(width, height, seed);
    }
    RAYPAGER_CHECK(false);
    return nullptr;
}

}  // namespace raypager
