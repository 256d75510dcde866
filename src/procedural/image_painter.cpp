#include "procedural/image_painter.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "base/files.hpp"

namespace raypager {

RowNoise::RowNoise(const Shape& shape, uint64_t seed) : height_(shape.height), sum_(shape.width) {
    float amplitude = 1, total = 0;
    uint32_t columns = shape.columns, rows = shape.rows;
    for (int i = 0; i < shape.octaves; i++) {
        Octave octave;
        octave.columns = std::clamp(columns, 1u, std::max(1u, shape.width / 2));
        octave.rows = std::clamp(rows, 1u, std::max(1u, shape.height / 2));
        octave.amplitude = amplitude;
        octave.seed = mix_bits(seed + 0x9e3779b97f4a7c15u * static_cast<uint64_t>(i + 1));
        octave.ends.resize(octave.columns);
        octave.at.resize(shape.width);
        for (uint32_t x = 0; x < shape.width; x++) {
            const uint64_t position = (2 * uint64_t{x} + 1) * octave.columns, cell = 2 * uint64_t{shape.width};
            const float t = static_cast<float>(position % cell) / static_cast<float>(cell);
            octave.ends[position / cell] = x + 1;
            octave.at[x] = t * t * (3 - 2 * t);
        }
        octave.upper.resize(octave.columns);
        octave.lower.resize(octave.columns);
        octave.here.resize(octave.columns + 1);
        total += amplitude;
        amplitude *= shape.gain;
        columns *= 2;
        rows *= 2;
        octaves_.push_back(std::move(octave));
    }
    for (Octave& octave : octaves_) octave.amplitude /= total;
}

void RowNoise::fill_lattice_row(const Octave& octave, uint64_t row, std::vector<float>& values) {
    for (uint32_t column = 0; column < octave.columns; column++) {
        const uint64_t hash = mix_bits(octave.seed ^ row << 32 ^ column);
        values[column] = octave.amplitude * (static_cast<float>(hash >> 40) * 0x1p-23f - 1);
    }
}

void RowNoise::move_to(Octave& octave, uint64_t row) {
    if (octave.upper_row == row) return;
    if (octave.lower_row == row)
        octave.upper.swap(octave.lower);
    else
        fill_lattice_row(octave, row, octave.upper);
    octave.upper_row = row;
    octave.lower_row = (row + 1) % octave.rows;
    fill_lattice_row(octave, octave.lower_row, octave.lower);
}

std::span<const float> RowNoise::row(uint32_t y) {
    for (size_t i = 0; i < octaves_.size(); i++) {
        Octave& octave = octaves_[i];
        const uint64_t position = (2 * uint64_t{y} + 1) * octave.rows, cell = 2 * uint64_t{height_};
        move_to(octave, position / cell);
        const float t = static_cast<float>(position % cell) / static_cast<float>(cell), down = t * t * (3 - 2 * t);
        for (uint32_t c = 0; c < octave.columns; c++) octave.here[c] = octave.upper[c] + (octave.lower[c] - octave.upper[c]) * down;
        octave.here[octave.columns] = octave.here[0];
        if (i == 0) std::fill(sum_.begin(), sum_.end(), 0.0f);
        const float* const at = octave.at.data();
        float* const sum = sum_.data();
        uint32_t x = 0;
        for (uint32_t c = 0; c < octave.columns; c++) {
            const float left = octave.here[c], step = octave.here[c + 1] - left;
            for (const uint32_t end = octave.ends[c]; x < end; x++) sum[x] += left + step * at[x];
        }
    }
    return sum_;
}

Result<uint64_t> write_image_file(const std::filesystem::path& path, ImagePainter& painter) {
    auto file = OutputFile::create(path);
    if (!file) return file.status();
    RAYPAGER_TRY(file->write(fmt::format("P{}\n{} {}\n255\n", painter.channels() == 3 ? 6 : 5, painter.width(), painter.height())));
    std::vector<uint8_t> bytes(size_t{painter.width()} * painter.channels());
    for (uint32_t y = 0; y < painter.height(); y++) {
        painter.row(y, bytes);
        RAYPAGER_TRY(file->write(std::as_bytes(std::span(bytes))));
    }
    const uint64_t written = file->position();
    RAYPAGER_TRY(file->commit());
    return written;
}

}  // namespace raypager
