#include "image/ptex_atlas.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <numeric>

#include "raypager/abi/texture.h"
#include "raypager/image_source.hpp"

namespace raypager {
namespace {

constexpr uint64_t max_band_bytes = uint64_t{1} << 30;

// Of a place on the curve: every second bit.
uint32_t every_second_bit(uint64_t place) {
    uint32_t result = 0;
    for (uint32_t bit = 0; bit < 32; bit++) result |= static_cast<uint32_t>(place >> 2 * bit & 1) << bit;
    return result;
}

}  // namespace

Result<std::shared_ptr<const PtexAtlas>> PtexAtlas::create(std::shared_ptr<const PtexFile> file, const ImageEncoding& encoding) {
    const std::shared_ptr<PtexAtlas> atlas(new PtexAtlas(std::move(file), encoding));
    const auto faces = atlas->file_->faces();
    std::vector<Spot>& spots = atlas->spots_;
    spots.resize(faces.size());
    std::vector<uint8_t> log_room(faces.size());  // squares, or two side by side
    for (size_t i = 0; i < faces.size(); i++) {
        Spot& spot = spots[i];
        spot.turned = faces[i].log_height > faces[i].log_width;
        spot.log_width = spot.turned ? faces[i].log_height : faces[i].log_width;
        spot.log_height = spot.turned ? faces[i].log_width : faces[i].log_height;
        log_room[i] = static_cast<uint8_t>(spot.log_width == spot.log_height ? 2 * spot.log_width : 2 * spot.log_width - 1);
    }
    std::vector<uint32_t> order(faces.size());
    std::iota(order.begin(), order.end(), 0u);
    std::stable_sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) { return log_room[a] > log_room[b]; });
    uint64_t end = 0;
    uint32_t rows = 0;
    for (const uint32_t face : order) {
        Spot& spot = spots[face];
        spot.x = every_second_bit(end);
        spot.y = every_second_bit(end >> 1);
        end += uint64_t{1} << log_room[face];
        rows = std::max(rows, spot.y + (1u << spot.log_height));
        atlas->band_rows_ = std::max(atlas->band_rows_, 1u << (log_room[face] / 2));
    }
    const auto log_area = static_cast<uint32_t>(std::bit_width(end - 1));
    const uint64_t columns = uint64_t{1} << (log_area + 1) / 2;
    if (columns > RP_IMAGE_MAX_SIZE || rows > RP_IMAGE_MAX_SIZE)
        return Status::failed(fmt::format("{}: its faces have more texels than an image can have", atlas->name()));
    StoredTexels texels = atlas->stored();
    texels.width = static_cast<uint32_t>(columns);
    texels.height = rows;
    atlas->shape_ = TexelConversion(atlas->name(), texels).shape();
    if (columns * atlas->band_rows_ * bytes_of_stored(texels.kind) * texels.channels > max_band_bytes)
        return Status::failed(fmt::format("{}: its largest faces do not fit into memory beside others", atlas->name()));
    atlas->by_row_ = std::move(order);
    std::stable_sort(atlas->by_row_.begin(), atlas->by_row_.end(), [&](uint32_t a, uint32_t b) { return spots[a].y < spots[b].y; });
    return std::shared_ptr<const PtexAtlas>(atlas);
}

StoredTexels PtexAtlas::stored() const {
    StoredTexels texels;
    texels.width = shape_.width;
    texels.height = shape_.height;
    texels.channels = file_->channels();
    texels.kind = file_->kind();
    texels.encoding = encoding_;
    return texels;
}

Status PtexAtlas::read(const std::function<Status(std::span<const std::byte> rows)>& take) const {
    const StoredTexels texels = stored();
    TexelConversion conversion(name(), texels);
    const size_t row_bytes = size_t{shape_.width} * texels.channels * bytes_of_stored(texels.kind);
    std::vector<std::byte> band;
    size_t next = 0;
    for (uint32_t first = 0; first < shape_.height; first += band_rows_) {
        const uint32_t rows = std::min(band_rows_, shape_.height - first);
        band.assign(row_bytes * rows, std::byte{0});
        for (; next < by_row_.size() && spots_[by_row_[next]].y < first + rows; next++) RAYPAGER_TRY(put_face(by_row_[next], first, band));
        for (uint32_t row = 0; row < rows; row++) RAYPAGER_TRY(take(conversion.convert(std::span(band).subspan(row * row_bytes, row_bytes))));
    }
    conversion.warn();
    return {};
}

Status PtexAtlas::put_face(uint32_t face, uint32_t first_row, std::vector<std::byte>& band) const {
    std::vector<std::byte> texels;
    RAYPAGER_TRY(file_->read_face(face, texels));
    const Spot& spot = spots_[face];
    const size_t texel_bytes = file_->channels() * bytes_of_stored(file_->kind());
    const size_t width = size_t{1} << spot.log_width, height = size_t{1} << spot.log_height;
    for (size_t y = 0; y < height; y++) {
        std::byte* const to = &band[((spot.y - first_row + y) * shape_.width + spot.x) * texel_bytes];
        if (!spot.turned) {
            std::memcpy(to, &texels[y * width * texel_bytes], width * texel_bytes);
            continue;
        }
        for (size_t x = 0; x < width; x++) std::memcpy(to + x * texel_bytes, &texels[(x * height + y) * texel_bytes], texel_bytes);
    }
    return {};
}

Result<uint64_t> PtexAtlas::fingerprint() const {
    const auto of_file = image_file_source(file_->path(), encoding_)->fingerprint();
    if (!of_file) return of_file;
    constexpr uint64_t layout = 0x5074657831ull;  // changes when faces are to lie otherwise
    return *of_file ^ layout;
}

Float2 PtexAtlas::place(uint64_t face, double u, double v) const {
    const Spot& spot = spots_[face < spots_.size() ? face : 0];
    if (spot.turned) std::swap(u, v);
    const auto along = [](uint32_t begin, uint32_t log_size, double share) {
        return begin + 0.5 + share * static_cast<double>((uint64_t{1} << log_size) - 1);
    };
    return {static_cast<float>(along(spot.x, spot.log_width, u) / shape_.width),
            static_cast<float>(along(spot.y, spot.log_height, v) / shape_.height)};
}

}  // namespace raypager
