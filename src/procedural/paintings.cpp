#include "procedural/paintings.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace raypager {
namespace {

using Palette = std::array<Paint, 5>;  // from a dark ground to a light accent

constexpr std::array<std::array<uint32_t, 5>, 8> palettes = {{{0x1b2a41, 0x324a5f, 0xb23a48, 0xe0a458, 0xfbf2d8},
                                                              {0x22223b, 0x4a4e69, 0x9a8c98, 0xc9ada7, 0xf2e9e4},
                                                              {0x283618, 0x606c38, 0xbc6c25, 0xdda15e, 0xfefae0},
                                                              {0x03071e, 0x6a040f, 0xd00000, 0xf48c06, 0xffdd70},
                                                              {0x0b3954, 0x087e8b, 0x5f8f7b, 0xff8a5c, 0xf4ecd6},
                                                              {0x2d1e2f, 0x5c3d5e, 0xa23b72, 0xf18f01, 0xf6e7cb},
                                                              {0x1d3557, 0x457b9d, 0xa8dadc, 0xe63946, 0xf1faee},
                                                              {0x2b2d24, 0x5a5a43, 0x8f7d4f, 0xc9a66b, 0xefe3c2}}};

Palette pick_palette(Random& random) {
    const auto& hex = palettes[random.below(palettes.size())];
    Palette palette{};
    for (size_t i = 0; i < palette.size(); i++) palette[i] = lit(paint_of(hex[i]), static_cast<float>(random.uniform(0.9, 1.08)));
    return palette;
}

// A row of colours under a brush, then on canvas. x across and y down are in units of the picture's height.
class BrushPainter : public ImagePainter {
public:
    BrushPainter(uint32_t width, uint32_t height, double aspect, uint64_t seed)
        : ImagePainter(width, height),
          random_(seed),
          palette_(pick_palette(random_)),
          aspect_(aspect),
          seed_(seed),
          brush_(noise_shape(random_.below(2) == 0 ? 40 : 150, 80, 2), seed + 1),
          colors_(width) {}

    void row(uint32_t y, std::span<uint8_t> bytes) final {
        paint(y, down(y));
        const std::span<const float> strokes = brush_.row(y);
        const RowGrain grain(y, seed_);
        for (uint32_t x = 0; x < width(); x++) {
            const float light = 0.98f + 0.22f * strokes[x], dust = static_cast<float>(grain(x)) * (10.0f / 256) - 5;
            const Paint& c = colors_[x];
            bytes[3 * size_t{x}] = quantized(c.r * light + dust);
            bytes[3 * size_t{x} + 1] = quantized(c.g * light + dust);
            bytes[3 * size_t{x} + 2] = quantized(c.b * light + dust);
        }
    }

protected:
    virtual void paint(uint32_t y, double down) = 0;

    double aspect() const { return aspect_; }
    std::vector<Paint>& colors() { return colors_; }
    void fill(const Paint& paint) { std::fill(colors_.begin(), colors_.end(), paint); }
    uint32_t column(double across) const { return static_cast<uint32_t>(std::clamp(across / aspect_, 0.0, 1.0) * width()); }
    void span(double from, double to, const Paint& paint) {
        for (uint32_t x = column(from), end = column(to); x < end; x++) colors_[x] = paint;
    }

    Random random_;
    const Palette palette_;

private:
    const double aspect_;
    const uint64_t seed_;
    RowNoise brush_;
    std::vector<Paint> colors_;
};

// Ranges of hills under a sky with clouds, sometimes with a sun and a lake.
class Landscape final : public BrushPainter {
public:
    Landscape(uint32_t width, uint32_t height, double aspect, uint64_t seed)
        : BrushPainter(width, height, aspect, seed), clouds_(noise_shape(3, 7, 5), seed + 2), ground_(noise_shape(20, 40, 3), seed + 3) {
        constexpr std::array<std::array<uint32_t, 4>, 5> hours = {{{0x4f7cac, 0xcfe0e8, 0x6d8a6a, 0x26361f},
                                                                   {0x274472, 0xf3b67a, 0x7d6b7d, 0x2a2333},
                                                                   {0x6c8ebf, 0xf1e3c6, 0xa8a15a, 0x4b4a1e},
                                                                   {0x1b2845, 0x65738e, 0x3e4a63, 0x10141f},
                                                                   {0x7fa6b8, 0xe8ece6, 0xb58a5a, 0x593a1f}}};
        const auto& hour = hours[random_.below(hours.size())];
        zenith_ = paint_of(hour[0]);
        low_sky_ = paint_of(hour[1]);
        horizon_ = random_.uniform(0.42, 0.62);
        sun_across_ = random_.uniform(0.15, 0.85) * aspect;
        sun_down_ = horizon_ * random_.uniform(0.35, 0.9);
        sun_radius_ = random_.uniform(0.03, 0.07);
        has_sun_ = random_.below(2) == 0;
        lake_ = random_.below(3) == 0 ? random_.uniform(0.72, 0.82) : 2;
        const uint32_t ranges = 3 + random_.below(3);
        for (uint32_t i = 0; i < ranges; i++) {
            const double near = static_cast<double>(i) / (ranges - 1);
            RowNoise outline({width, 1, 2 + i, 1, 6, 0.45f}, seed + 10 + i);
            const std::span<const float> heights = outline.row(0);
            Range range;
            range.color = blended(paint_of(hour[2]), paint_of(hour[3]), static_cast<float>(near));
            for (const float h : heights) range.top.push_back(static_cast<float>(horizon_ + 0.34 * near - (0.22 - 0.09 * near) * h));
            ranges_.push_back(std::move(range));
        }
    }

private:
    struct Range {
        Paint color;
        std::vector<float> top;
    };

    void paint(uint32_t y, double down) override {
        const bool lake = down > lake_;
        const double above = lake ? 2 * lake_ - down : down;
        const Paint sky = blended(zenith_, low_sky_, static_cast<float>(std::clamp(above / horizon_, 0.0, 1.0)));
        const std::span<const float> cloud = clouds_.row(y), ground = ground_.row(y);
        std::vector<Paint>& row = colors();
        if (lake) {
            for (uint32_t x = 0; x < width(); x++) row[x] = lit(sky, 0.72f + 0.25f * ground[x]);
            return;
        }
        const Paint white = blended(low_sky_, {250, 248, 244}, 0.6f);
        for (uint32_t x = 0; x < width(); x++) row[x] = blended(sky, white, std::clamp(2.2f * cloud[x], 0.0f, 0.85f));
        const double off = (down - sun_down_) / sun_radius_;
        if (has_sun_ && off * off < 1) {
            const double half = sun_radius_ * std::sqrt(1 - off * off);
            span(sun_across_ - half, sun_across_ + half, {255, 240, 196});
        }
        const auto level = static_cast<float>(down);
        for (const Range& range : ranges_)
            for (uint32_t x = 0; x < width(); x++)
                if (level > range.top[x]) row[x] = lit(range.color, 1.05f + 0.55f * ground[x] - 0.5f * std::min(level - range.top[x], 0.5f));
    }

    Paint zenith_, low_sky_;
    double horizon_ = 0.5, sun_across_ = 0, sun_down_ = 0, sun_radius_ = 0, lake_ = 2;
    bool has_sun_ = false;
    std::vector<Range> ranges_;
    RowNoise clouds_, ground_;
};

// Discs, rounds and bars, one over the other.
struct Spot {
    double across, down, half_width, half_height;
    Paint color;
    float shade = 0;  // how much darker it gets to the right, as if it were round
    bool square = false;
};

class Spots : public BrushPainter {
public:
    using BrushPainter::BrushPainter;

protected:
    std::vector<Spot> spots_;
    void paint(uint32_t /*y*/, double down) override {
        for (const Spot& spot : spots_) {
            const double off = (down - spot.down) / spot.half_height;
            if (off * off >= 1) continue;
            const double half = spot.square ? spot.half_width : spot.half_width * std::sqrt(1 - off * off);
            if (spot.shade == 0) {
                span(spot.across - half, spot.across + half, spot.color);
                continue;
            }
            const uint32_t begin = column(spot.across - half), end = column(spot.across + half);
            const auto step = static_cast<float>(aspect() / width() / spot.half_width);
            float side = static_cast<float>((begin + 0.5) * aspect() / width() - spot.across) / static_cast<float>(spot.half_width);
            const float lower = 1 - 0.3f * spot.shade * static_cast<float>(off);
            for (uint32_t x = begin; x < end; x++, side += step)
                colors()[x] = lit(spot.color, lower - spot.shade * (0.5f * side + 0.5f * side * side));
        }
    }
};

class Portrait final : public Spots {
public:
    Portrait(uint32_t width, uint32_t height, double aspect, uint64_t seed)
        : Spots(width, height, aspect, seed), ground_(noise_shape(5, 5, 4), seed + 2) {
        constexpr std::array<uint32_t, 5> skins = {0xe8bd9c, 0xd9a382, 0xb27a55, 0x8a5a3c, 0xf0cfb4};
        constexpr std::array<uint32_t, 5> hairs = {0x2b1b12, 0x5a3a1e, 0x9a6b35, 0x3d3a3a, 0xb8b0a4};
        const Paint skin = paint_of(skins[random_.below(skins.size())]), hair = paint_of(hairs[random_.below(hairs.size())]);
        const Paint cloth = palette_[random_.below(3)], collar = palette_[4];
        const double size = std::min(1.0, 1.25 * aspect), x = 0.5 * aspect + random_.uniform(-0.05, 0.05) * aspect;
        const double y = random_.uniform(0.38, 0.44), w = random_.uniform(0.125, 0.15) * size, h = random_.uniform(0.175, 0.2) * size;
        const double locks = random_.uniform(1.05, 1.5), turn = random_.uniform(-0.25, 0.25) * w;
        const auto add = [&](double dx, double dy, double rx, double ry, const Paint& color, float shade) {
            spots_.push_back({x + dx, y + dy, rx, ry, color, shade});
        };
        add(0, 0.1 * h, 1.25 * w, locks * 1.15 * h, hair, 0.35f);
        add(0, 3.6 * h, 3.0 * w, 2.2 * h, cloth, 0.5f);
        add(0, 1.5 * h, 0.95 * w, 0.5 * h, collar, 0.4f);
        add(0, 1.1 * h, 0.5 * w, 0.7 * h, lit(skin, 0.82f), 0.4f);
        add(0, 0, w, h, skin, 0.45f);
        add(turn * 0.4, -0.75 * h, 1.02 * w, 0.42 * h, hair, 0.35f);
        for (const double side : {-0.42, 0.42}) {
            add(turn + side * w, -0.06 * h, 0.19 * w, 0.075 * h, {236, 230, 220}, 0.2f);
            add(turn + side * w, -0.06 * h, 0.085 * w, 0.075 * h, {46, 36, 30}, 0);
            add(turn + side * w, -0.23 * h, 0.24 * w, 0.035 * h, hair, 0);
        }
        add(turn * 1.3, 0.18 * h, 0.12 * w, 0.22 * h, lit(skin, 0.9f), 0.5f);
        add(turn, 0.52 * h, 0.3 * w, 0.055 * h, {150, 66, 58}, 0.3f);
    }

private:
    void paint(uint32_t y, double down) override {
        const std::span<const float> n = ground_.row(y);
        const Paint base = blended(lit(palette_[1], 0.75f), lit(palette_[0], 0.7f), static_cast<float>(down));
        for (uint32_t x = 0; x < width(); x++) colors()[x] = lit(base, 1 + 0.7f * n[x]);
        Spots::paint(y, down);
    }
    RowNoise ground_;
};

class Circles final : public Spots {
public:
    Circles(uint32_t width, uint32_t height, double aspect, uint64_t seed) : Spots(width, height, aspect, seed) {
        const uint32_t count = 12 + random_.below(26);
        for (uint32_t i = 0; i < count; i++) {
            const double x = random_.uniform(0, aspect), y = random_.uniform(), u = random_.uniform(), r = 0.03 + 0.22 * u * u;
            const Paint outer = palette_[random_.below(4)], inner = palette_[1 + random_.below(4)];
            const bool bar = random_.below(4) == 0;
            spots_.push_back({x, y, bar ? 2.5 * r : r, bar ? 0.12 * r : r, outer, 0, bar});
            if (!bar && random_.below(2) == 0) spots_.push_back({x, y, 0.62 * r, 0.62 * r, inner, 0.2f});
        }
    }

private:
    void paint(uint32_t y, double down) override {
        fill(blended(palette_[4], palette_[3], 0.25f * static_cast<float>(down)));
        Spots::paint(y, down);
    }
};

// Rectangles between black lines: what is left of the picture is divided again and again.
class Grid final : public Spots {
public:
    Grid(uint32_t width, uint32_t height, double aspect, uint64_t seed) : Spots(width, height, aspect, seed) {
        line_ = random_.uniform(0.006, 0.016);
        divide(0, 0, aspect, 1, 5);
    }

private:
    void divide(double x0, double y0, double x1, double y1, int depth) {
        const double w = x1 - x0, h = y1 - y0, share = random_.uniform(0.25, 0.75);
        const bool ends = random_.below(5) == 0;
        if (depth == 0 || std::max(w, h) < 0.15 || (depth < 4 && ends)) {
            const uint32_t kind = random_.below(8);
            const Paint color = kind < 4 ? palette_[kind] : blended(palette_[4], {255, 255, 255}, 0.4f);
            spots_.push_back({0.5 * (x0 + x1), 0.5 * (y0 + y1), 0.5 * w - line_, 0.5 * h - line_, color, 0, true});
        } else if (w > h) {
            divide(x0, y0, x0 + share * w, y1, depth - 1);
            divide(x0 + share * w, y0, x1, y1, depth - 1);
        } else {
            divide(x0, y0, x1, y0 + share * h, depth - 1);
            divide(x0, y0 + share * h, x1, y1, depth - 1);
        }
    }
    void paint(uint32_t y, double down) override {
        fill({24, 22, 24});
        Spots::paint(y, down);
    }
    double line_ = 0.01;
};

// Soft rectangles of colour over each other, or stripes.
class Fields final : public BrushPainter {
public:
    Fields(uint32_t width, uint32_t height, double aspect, uint64_t seed)
        : BrushPainter(width, height, aspect, seed), wash_(noise_shape(12, 12, 4), seed + 2) {
        const uint32_t count = random_.below(2) == 0 ? 2 + random_.below(2) : 6 + random_.below(10);
        soft_ = count > 4 ? 0.004 : 0.03;
        for (double top = 0.06; edges_.size() < count;) {
            const double rest = (0.94 - top) / static_cast<double>(count - edges_.size());
            const double high = edges_.size() + 1 == count ? rest : rest * random_.uniform(0.5, 1.4);
            edges_.push_back({top, top + high - 0.02});
            const auto light = static_cast<float>(random_.uniform(0.8, 1.1));
            inks_.push_back(lit(palette_[1 + random_.below(4)], light));
            top += high;
        }
    }

private:
    void paint(uint32_t y, double down) override {
        fill(palette_[0]);
        const std::span<const float> wash = wash_.row(y);
        const auto scale = static_cast<float>(1 / soft_), unit = static_cast<float>(aspect() / width()), wide = static_cast<float>(aspect());
        for (size_t i = 0; i < edges_.size(); i++) {
            const auto inside = static_cast<float>(std::min(down - edges_[i][0], edges_[i][1] - down));
            if (inside < -0.03f) continue;
            for (uint32_t x = 0; x < width(); x++) {
                const float across = (static_cast<float>(x) + 0.5f) * unit, side = std::min(across, wide - across) - 0.06f;
                const float cover = std::clamp((std::min(inside, side) + 0.03f * wash[x]) * scale, 0.0f, 0.94f);
                colors()[x] = blended(colors()[x], lit(inks_[i], 1 + 0.4f * wash[x]), cover);
            }
        }
    }
    double soft_ = 0.03;
    std::vector<std::array<double, 2>> edges_;
    std::vector<Paint> inks_;
    RowNoise wash_;
};

// Paint that has run together: bands of a palette along the levels of a noise.
class Clouds final : public BrushPainter {
public:
    Clouds(uint32_t width, uint32_t height, double aspect, uint64_t seed) : BrushPainter(width, height, aspect, seed), noise_(shape(), seed + 2) {}

private:
    RowNoise::Shape shape() {
        const uint32_t rows = 2 + random_.below(4), columns = 2 + random_.below(3);
        return noise_shape(columns, rows, 6);
    }

    void paint(uint32_t y, double down) override {
        const std::span<const float> n = noise_.row(y);
        const auto drift = static_cast<float>(1.5 * down);
        for (uint32_t x = 0; x < width(); x++) {
            const float level = 8 + 6 * n[x] + drift;
            const auto band = static_cast<uint32_t>(level);
            const float t = level - static_cast<float>(band);
            colors()[x] = blended(palette_[band % 5], palette_[(band + 1) % 5], t * t * (3 - 2 * t));
        }
    }
    RowNoise noise_;
};

}  // namespace

std::unique_ptr<ImagePainter> make_painting(uint32_t width, uint32_t height, double aspect, uint64_t seed) {
    const uint32_t lot = Random(seed, 77).below(16);
    // People sit upright, and are seldom painted far wider than high.
    if (lot < 6 && aspect < 1.1) return std::make_unique<Portrait>(width, height, aspect, seed);
    if (lot < 8) return std::make_unique<Landscape>(width, height, aspect, seed);
    if (lot < 10) return std::make_unique<Circles>(width, height, aspect, seed);
    if (lot < 12) return std::make_unique<Grid>(width, height, aspect, seed);
    if (lot < 14) return std::make_unique<Fields>(width, height, aspect, seed);
    return std::make_unique<Clouds>(width, height, aspect, seed);
}

}  // namespace raypager
