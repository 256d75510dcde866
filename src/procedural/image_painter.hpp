// Images that are made up a row at a time and written as they come: binary PPM for colours, PGM for greys. Nothing of an image is kept but
// the row at hand. They come out the same on every machine, as everything here does.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include "procedural/numeric.hpp"
#include "raypager/status.hpp"

namespace raypager {

struct Paint {
    float r = 0, g = 0, b = 0;  // sRGB, 0 to 255
};
inline Paint blended(const Paint& a, const Paint& b, float t) { return {a.r + (b.r - a.r) * t, a.g + (b.g - a.g) * t, a.b + (b.b - a.b) * t}; }
inline Paint lit(const Paint& a, float factor) { return {a.r * factor, a.g * factor, a.b * factor}; }
constexpr Paint paint_of(uint32_t hex) { return {static_cast<float>(hex >> 16), static_cast<float>(hex >> 8 & 255), static_cast<float>(hex & 255)}; }

// Value noise of several octaves, each twice as fine as the one before. It repeats at the borders, so that an image of it can be a tile. All
// that a texel costs is an interpolation for each octave: what depends on its column stands in tables.
class RowNoise {
public:
    struct Shape {
        uint32_t width, height;  // of the image
        uint32_t columns, rows;  // lattice cells of the first octave across and down; as many as there are texels at most
        int octaves = 1;
        float gain = 0.5f;  // each octave's amplitude over that of the one before
    };
    RowNoise(const Shape& shape, uint64_t seed);
    // Within [-1, 1], mostly within half of it. Row after row is the quick way.
    std::span<const float> row(uint32_t y);

private:
    struct Octave {
        uint32_t columns, rows;
        float amplitude;
        uint64_t seed;
        std::vector<uint32_t> ends;             // of each cell: the column of texels behind it
        std::vector<float> at;                  // how far in its cell a column of texels is, smoothed
        std::vector<float> upper, lower, here;  // values of these two rows of the lattice, and at the row of texels
        uint64_t upper_row = UINT64_MAX, lower_row = UINT64_MAX;
    };
    static void fill_lattice_row(const Octave& octave, uint64_t row, std::vector<float>& values);
    static void move_to(Octave& octave, uint64_t row);

    uint32_t height_;
    std::vector<Octave> octaves_;
    std::vector<float> sum_;
};

// A random number for each texel of a row, 0 to 255: the grain of paper and canvas, which also keeps images from being packed.
class RowGrain {
public:
    RowGrain(uint32_t y, uint64_t seed) : row_(static_cast<uint32_t>(mix_bits(seed ^ uint64_t{y} << 32))) {}
    uint32_t operator()(uint32_t x) const {
        uint32_t h = (x + 1) * 0x9e3779b1u ^ row_;
        h = (h ^ h >> 15) * 0x85ebca77u;
        return h >> 24;
    }

private:
    uint32_t row_;
};

class ImagePainter {
public:
    ImagePainter(uint32_t width, uint32_t height) : width_(width), height_(height) {}
    virtual ~ImagePainter() = default;
    // Row y from the top, as bytes of the file. Rows are asked for in order.
    virtual void row(uint32_t y, std::span<uint8_t> bytes) = 0;
    virtual uint32_t channels() const { return 3; }
    uint32_t width() const { return width_; }
    uint32_t height() const { return height_; }

protected:
    double down(uint32_t y) const { return (y + 0.5) / height_; }  // 0 at the top, 1 at the bottom
    RowNoise::Shape noise_shape(uint32_t columns, uint32_t rows, int octaves) const { return {width_, height_, columns, rows, octaves}; }

private:
    uint32_t width_, height_;
};

// Bytes of texels. Values beyond 0 and 255 become the nearest of these.
inline uint8_t quantized(float value) { return static_cast<uint8_t>(value < 0 ? 0 : value > 255 ? 255 : value); }

// Returns how many bytes the file has.
Result<uint64_t> write_image_file(const std::filesystem::path& path, ImagePainter& painter);

}  // namespace raypager
