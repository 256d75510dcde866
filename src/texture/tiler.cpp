#include "texture/tiler.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>

#include "base/half.hpp"

namespace raypager {
namespace {

// Places of texels along an axis of a tile; `shift`: of the axis' lowest bit. The bits of a longer axis that have no partner come last.
std::vector<uint32_t> morton_places(uint32_t log_size, uint32_t log_other, uint32_t shift) {
    std::vector<uint32_t> places(size_t{1} << log_size);
    for (uint32_t i = 0; i < places.size(); i++)
        for (uint32_t bit = 0; bit < log_size; bit++)
            if (i >> bit & 1u) places[i] |= 1u << (bit < log_other ? 2 * bit + shift : log_other + bit);
    return places;
}

// A row into the tiles that lie side by side; y: of its places. Two texels beside each other lie so in a tile as well.
template <size_t bytes>
void scatter(const std::byte* texels, uint32_t width, uint32_t y, std::span<const uint32_t> places, std::byte* tiles) {
    const auto tile_width = static_cast<uint32_t>(places.size());
    uint32_t first = 0;
    for (; first + tile_width <= width; first += tile_width, tiles += RP_TEXTURE_PAGE_BYTES)
        for (uint32_t x = 0; x < tile_width; x += 2) std::memcpy(tiles + (places[x] + y) * bytes, texels + size_t{first + x} * bytes, 2 * bytes);
    if (first == width) return;
    for (uint32_t x = 0; x < tile_width; x++)
        std::memcpy(tiles + (places[x] + y) * bytes, texels + size_t{std::min(first + x, width - 1)} * bytes, bytes);
}

void scatter_texels(size_t bytes, const std::byte* texels, uint32_t width, uint32_t y, std::span<const uint32_t> places, std::byte* tiles) {
    switch (bytes) {
        case 1:
            return scatter<1>(texels, width, y, places, tiles);
        case 2:
            return scatter<2>(texels, width, y, places, tiles);
        case 4:
            return scatter<4>(texels, width, y, places, tiles);
        default:
            return scatter<8>(texels, width, y, places, tiles);
    }
}

// n texels into (n + 1) / 2, each the mean of the area that it covers.
template <size_t channels>
void halve(const float* values, uint32_t n, float* halved) {
    const uint32_t m = next_level_size(n);
    if (n % 2 == 0) {
        for (size_t i = 0; i < m; i++)
            for (size_t c = 0; c < channels; c++)
                halved[i * channels + c] = 0.5f * (values[2 * i * channels + c] + values[(2 * i + 1) * channels + c]);
        return;
    }
    const float share = 1.0f / static_cast<float>(n);
    for (uint32_t i = 0; i < m; i++) {
        const float before = static_cast<float>(i) * share, middle = static_cast<float>(m) * share, after = static_cast<float>(m - 1 - i) * share;
        const float* left = values + (i == 0 ? size_t{0} : size_t{2} * i - 1) * channels;
        const float* center = values + size_t{2} * i * channels;
        const float* right = values + (i + 1 == m ? size_t{2} * i : size_t{2} * i + 1) * channels;
        for (size_t c = 0; c < channels; c++) halved[size_t{i} * channels + c] = before * left[c] + middle * center[c] + after * right[c];
    }
}

void add_scaled(const std::vector<float>& row, float factor, std::vector<float>& sum) {
    for (size_t i = 0; i < row.size(); i++) sum[i] += factor * row[i];
}

void make_finite(std::vector<std::byte>& halves) {
    for (size_t i = 0; i + 1 < halves.size(); i += 2) {
        uint16_t half;
        std::memcpy(&half, halves.data() + i, sizeof half);
        half = finite_half(half);
        std::memcpy(halves.data() + i, &half, sizeof half);
    }
}

bool has_halves(uint32_t format) { return format == RP_TEXEL_GRAY_HALF || format == RP_TEXEL_RGBA_HALF; }

}  // namespace

uint64_t ImageTiler::memory_bytes(const ImageShape& shape) {
    const uint32_t format = format_of(shape);
    uint64_t bytes = 0;
    for (uint32_t width = shape.width, height = shape.height; is_tiled(width, height);
         width = next_level_size(width), height = next_level_size(height))
        bytes += tile_shape(format).across(width) * RP_TEXTURE_PAGE_BYTES;
    constexpr uint64_t rows_of_values = 5;  // of level 0 one, and of all others three that are half as wide at most
    return bytes + RP_TEXTURE_PAGE_BYTES + rows_of_values * shape.width * shape.channels * sizeof(float);
}

ImageTiler::ImageTiler(std::string name, const rp_image& image, std::span<const rp_image_level> levels, PageTakers takers)
    : name_(std::move(name)),
      image_(image),
      codec_(texel_codec(image.format, image.srgb != 0)),
      tile_(tile_shape(image.format)),
      takers_(std::move(takers)) {
    morton_x_ = morton_places(tile_.log_width, tile_.log_height, 0);
    morton_y_ = morton_places(tile_.log_height, tile_.log_width, 1);
    const size_t row = size_t{levels.front().width} * codec_.channels;
    values_.resize(row);
    texels_.resize(size_t{levels.front().width} * texel_bytes(image.format));
    for (const rp_image_level& record : levels) {
        Level& level = levels_.emplace_back();
        level.record = record;
        const bool tiled = record.at == RP_NONE;
        level.band.resize(tiled ? tile_.across(record.width) * RP_TEXTURE_PAGE_BYTES : tail_bytes(image.format, record.width, record.height));
        if (levels_.size() == levels.size()) break;
        const size_t next = size_t{next_level_size(record.width)} * codec_.channels;
        for (auto& sum : level.sums) sum.resize(next);
        level.half_wide.resize(next);
    }
}

Status ImageTiler::take(std::span<const std::byte> rows) {
    const size_t row_bytes = texels_.size();
    if (rows.size() % row_bytes != 0 || rows.size() / row_bytes > levels_[0].record.height - levels_[0].rows)
        return Status::failed(name_ + ": has other rows than its size says; it changed while it was read");
    for (; !rows.empty(); rows = rows.subspan(row_bytes)) {
        const std::byte* texels = rows.data();
        if (has_halves(image_.format)) {
            std::memcpy(texels_.data(), texels, row_bytes);
            make_finite(texels_);
            texels = texels_.data();
        }
        if (!is_last(0)) codec_.decode(texels, levels_[0].record.width, values_.data());
        RAYPAGER_TRY(put_row(0, texels));
        RAYPAGER_TRY(hand_on(0, values_.data()));
    }
    return {};
}

Status ImageTiler::finish() {
    const rp_image_level& first = levels_[0].record;
    if (levels_[0].rows != first.height)
        return Status::failed(fmt::format("{}: ended after {} of {} rows; it changed while it was read", name_, levels_[0].rows, first.height));
    const auto tail = std::find_if(levels_.begin(), levels_.end(), [](const Level& level) { return level.record.at != RP_NONE; });
    std::vector<std::byte> bytes;
    for (auto level = tail; level != levels_.end(); ++level) bytes.insert(bytes.end(), level->band.begin(), level->band.end());
    return takers_.tail(tail->record.page, tail->record.at, bytes);
}

Status ImageTiler::put_row(size_t index, const std::byte* texels) {
    Level& level = levels_[index];
    const rp_image_level& record = level.record;
    const uint32_t row = level.rows++, bytes = texel_bytes(image_.format);
    if (takers_.row) takers_.row(static_cast<uint32_t>(index), std::span(texels, size_t{record.width} * bytes));
    if (record.at != RP_NONE) {
        std::memcpy(level.band.data() + size_t{row} * record.width * bytes, texels, size_t{record.width} * bytes);
        return {};
    }
    const bool last = level.rows == record.height;
    uint32_t y = row % tile_.height();
    scatter_texels(bytes, texels, record.width, morton_y_[y], morton_x_, level.band.data());
    // What lies below the image repeats its last row.
    if (last)
        while (++y < tile_.height()) scatter_texels(bytes, texels, record.width, morton_y_[y], morton_x_, level.band.data());
    return last || level.rows % tile_.height() == 0 ? put_pages(level) : Status();
}

Status ImageTiler::put_pages(Level& level) {
    const auto across = static_cast<uint32_t>(tile_.across(level.record.width));
    const uint32_t first = level.record.page + (level.rows - 1) / tile_.height() * across;
    for (uint32_t tile = 0; tile < across; tile++)
        RAYPAGER_TRY(takers_.page(first + tile, std::span(level.band).subspan(size_t{tile} * RP_TEXTURE_PAGE_BYTES, RP_TEXTURE_PAGE_BYTES)));
    return {};
}

// The row that was just put, into those of the next level that it is a part of. Of an odd number of rows each second one is a part of two.
Status ImageTiler::hand_on(size_t index, const float* values) {
    if (is_last(index)) return {};
    Level& level = levels_[index];
    const uint32_t n = level.record.height, m = next_level_size(n), row = level.rows - 1, of_next = row / 2;
    (codec_.channels == 1 ? halve<1> : halve<4>)(values, level.record.width, level.half_wide.data());
    if (n % 2 == 0) {
        add_scaled(level.half_wide, 0.5f, level.sums[0]);
        return row % 2 == 1 ? finish_row_of_next(index) : Status();
    }
    const float share = 1.0f / static_cast<float>(n);
    if (row % 2 == 0) {
        add_scaled(level.half_wide, static_cast<float>(m) * share, level.sums[0]);
        return row + 1 == n ? finish_row_of_next(index) : Status();
    }
    add_scaled(level.half_wide, static_cast<float>(m - 1 - of_next) * share, level.sums[0]);
    add_scaled(level.half_wide, static_cast<float>(of_next + 1) * share, level.sums[1]);
    return finish_row_of_next(index);
}

Status ImageTiler::finish_row_of_next(size_t index) {
    Level& level = levels_[index];
    codec_.encode(level.sums[0].data(), levels_[index + 1].record.width, texels_.data());
    RAYPAGER_TRY(put_row(index + 1, texels_.data()));
    RAYPAGER_TRY(hand_on(index + 1, level.sums[0].data()));
    std::swap(level.sums[0], level.sums[1]);
    std::ranges::fill(level.sums[1], 0.0f);
    return {};
}

Status tile_image(const ImageSource& source, const rp_image& image, std::span<const rp_image_level> levels, PageTakers takers,
                  const std::function<Status(uint32_t rows_before)>& before_rows) {
    ImageTiler tiler(source.name(), image, levels, std::move(takers));
    const auto take = [&](std::span<const std::byte> rows) -> Status {
        if (before_rows) RAYPAGER_TRY(before_rows(tiler.rows_taken()));
        return tiler.take(rows);
    };
    RAYPAGER_TRY(source.read(take));
    return tiler.finish();
}

}  // namespace raypager
