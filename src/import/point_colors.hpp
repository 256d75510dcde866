// What colour a point of a file gets.
#pragma once

#include <cstdint>
#include <span>

#include "import/point_readers.hpp"

namespace raypager {

// Chosen once a file, from points spread over it; a pure function of these, so that the same file always looks the same.
// - Colours, unless all are black: the file has the fields but nothing in them. Their scale is the smallest of 1 (numbers only), 255 and
//   65535 that holds them all.
// - Else classes, if there are at least two beside "unclassified": a palette of muted map colours, lightened and darkened by intensity.
// - Else intensity, as greys between the darkest and the lightest percents.
// - Else none: the points look as the shape's material does.
class PointColors {
public:
    static PointColors choose(const PointFields& fields, std::span<const FilePoint> sample);
    bool any() const { return kind_ != Kind::none; }
    // sRGB, red | green << 8 | blue << 16
    uint32_t of(const FilePoint& point) const;

private:
    enum class Kind { none, colors, classes, intensity };
    float lightness(const FilePoint& point) const;  // 0 to 1 from intensity
    Kind kind_ = Kind::none;
    float color_scale_ = 1;
    float darkest_ = 0, lightest_ = 0;
};

}  // namespace raypager
