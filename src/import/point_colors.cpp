#include "import/point_colors.hpp"

#include <algorithm>
#include <bitset>
#include <cmath>
#include <vector>

namespace raypager {
namespace {

constexpr uint32_t rgb(uint32_t red, uint32_t green, uint32_t blue) { return red | green << 8 | blue << 16; }

// By ASPRS standard point class.
constexpr uint32_t unclassified = rgb(152, 148, 142);
constexpr uint32_t palette[] = {
    unclassified,       unclassified,      rgb(148, 126, 96),  // 2 ground
    rgb(134, 152, 88),                                         // 3 low vegetation
    rgb(102, 134, 70),                                         // 4 medium vegetation
    rgb(74, 112, 58),                                          // 5 high vegetation
    rgb(186, 122, 98),                                         // 6 building
    unclassified,       unclassified,      rgb(82, 118, 142),  // 9 water
    rgb(116, 104, 98),                                         // 10 rail
    rgb(104, 104, 106),                                        // 11 road surface
    unclassified,       rgb(196, 176, 84),                     // 13 wire: guard
    rgb(196, 176, 84),                                         // 14 wire: conductor
    rgb(150, 142, 120),                                        // 15 transmission tower
    rgb(196, 176, 84),                                         // 16 wire: insulator
    rgb(142, 138, 132),                                        // 17 bridge deck
};

uint32_t to_byte(float unit) { return static_cast<uint32_t>(std::lround(std::clamp(unit, 0.0f, 1.0f) * 255.0f)); }

float largest_component(std::span<const FilePoint> sample) {
    float largest = 0;
    for (const FilePoint& p : sample)
        for (const float c : p.color) largest = c > largest ? c : largest;
    return largest;
}

float scale_of(ColorType type, float largest) {
    if (type == ColorType::byte) return 255;
    if (type == ColorType::number && largest <= 1) return 1;
    return largest <= 255 ? 255.0f : 65535.0f;
}

// Two classes that say something.
bool has_classes(std::span<const FilePoint> sample) {
    std::bitset<256> seen;
    for (const FilePoint& p : sample) seen.set(p.classification);
    seen.reset(0).reset(1);
    return seen.count() >= 2;
}

}  // namespace

PointColors PointColors::choose(const PointFields& fields, std::span<const FilePoint> sample) {
    PointColors colors;
    if (sample.empty()) return colors;
    if (fields.intensity) {
        std::vector<float> values;
        for (const FilePoint& p : sample)
            if (p.intensity - p.intensity == 0) values.push_back(p.intensity);  // finite
        const auto percent = [&](size_t share) {
            const auto at = values.begin() + static_cast<ptrdiff_t>((values.size() - 1) * share / 100);
            std::nth_element(values.begin(), at, values.end());
            return *at;
        };
        if (!values.empty()) {
            colors.darkest_ = percent(2);
            colors.lightest_ = percent(98);
        }
    }
    const bool intensity = colors.lightest_ > colors.darkest_;
    const float largest = fields.color ? largest_component(sample) : 0.0f;
    if (largest > 0) {
        colors.kind_ = Kind::colors;
        colors.color_scale_ = 1 / scale_of(fields.color_type, largest);
    } else if (fields.classification && has_classes(sample)) {
        colors.kind_ = Kind::classes;
    } else if (intensity) {
        colors.kind_ = Kind::intensity;
    }
    return colors;
}

float PointColors::lightness(const FilePoint& point) const {
    if (!(lightest_ > darkest_)) return 0.5f;
    const float t = (point.intensity - darkest_) / (lightest_ - darkest_);
    return t > 0 ? std::min(t, 1.0f) : 0.0f;
}

uint32_t PointColors::of(const FilePoint& point) const {
    switch (kind_) {
        case Kind::colors: {
            const auto byte = [&](size_t c) { return point.color[c] > 0 ? to_byte(point.color[c] * color_scale_) : 0u; };
            return rgb(byte(0), byte(1), byte(2));
        }
        case Kind::classes: {
            const uint32_t color = point.classification < std::size(palette) ? palette[point.classification] : unclassified;
            const float factor = (0.8f + 0.4f * lightness(point)) / 255;
            return rgb(to_byte(static_cast<float>(color & 255) * factor), to_byte(static_cast<float>(color >> 8 & 255) * factor),
                       to_byte(static_cast<float>(color >> 16) * factor));
        }
        case Kind::intensity: {
            // Never black nor white: what matters is the light on it.
            const uint32_t grey = to_byte(0.30f + 0.55f * lightness(point));
            return rgb(grey, grey, grey);
        }
        case Kind::none:
            break;
    }
    return rgb(255, 255, 255);
}

}  // namespace raypager
