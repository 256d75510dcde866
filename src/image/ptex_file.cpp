#include "image/ptex_file.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cstring>

namespace raypager {
namespace {

constexpr uint32_t magic = 0x78657450;  // "Ptex"
constexpr size_t header_bytes = 64, level_bytes = 16, face_bytes = 20;
constexpr uint32_t max_faces = 1u << 28, max_log_texels = 26;  // of a face
constexpr uint64_t max_inflation = 1100;                       // deflate packs at most so well

enum Encoding : uint32_t { constant, zipped, differences, tiled };

struct Header {
    uint32_t magic, version, mesh_type, data_type;
    int32_t alpha_channel;
    uint16_t channels, levels;
    uint32_t faces, extension_bytes, face_info_bytes, constants_bytes, level_info_bytes, minor_version;
    uint64_t level_data_bytes;
    uint32_t metadata_bytes, metadata_unpacked_bytes;
};
static_assert(sizeof(Header) == header_bytes);

// Each value was stored as what it is more than the one before it.
template <class T>
void sum_up(std::span<std::byte> bytes) {
    T sum = 0;
    for (size_t at = 0; at + sizeof(T) <= bytes.size(); at += sizeof(T)) {
        T difference;
        std::memcpy(&difference, &bytes[at], sizeof(T));
        sum = static_cast<T>(sum + difference);
        std::memcpy(&bytes[at], &sum, sizeof(T));
    }
}

}  // namespace

Status PtexFile::bad(const std::string& what) const {
    return Status::failed(fmt::format("{}: {}; the Ptex file is damaged or of a kind that is not supported", file_.path().string(), what));
}

Result<std::shared_ptr<const PtexFile>> PtexFile::open(const std::filesystem::path& path) {
    auto file = InputFile::open(path);
    if (!file) return file.status();
    const std::shared_ptr<PtexFile> ptex(new PtexFile(std::move(*file)));
    RAYPAGER_TRY(ptex->read_header());
    return std::shared_ptr<const PtexFile>(ptex);
}

Status PtexFile::read_header() {
    std::array<std::byte, header_bytes> bytes;
    if (file_.size() < bytes.size()) return bad("it is shorter than its header");
    RAYPAGER_TRY(file_.read(0, bytes));
    Header h;
    std::memcpy(&h, bytes.data(), sizeof h);
    if (h.magic != magic) return bad("it does not begin with \"Ptex\"");
    if (h.version != 1) return bad(fmt::format("version {} is not known", h.version));
    if (h.mesh_type != 1) return bad("its faces are triangles, not quads");
    constexpr StoredKind kinds[] = {StoredKind::unsigned_8, StoredKind::unsigned_16, StoredKind::half, StoredKind::float_32};
    if (h.data_type >= std::size(kinds)) return bad(fmt::format("data type {} is not known", h.data_type));
    if (h.channels == 0 || h.channels > 64 || h.levels == 0) return bad("it has no channels or levels, or too many");
    if (h.faces == 0 || h.faces > max_faces || uint64_t{h.faces} * face_bytes > max_inflation * h.face_info_bytes)
        return bad(fmt::format("it cannot have {} faces", h.faces));
    if (h.level_info_bytes != level_bytes * h.levels) return bad("its list of levels is of a wrong size");
    kind_ = kinds[h.data_type];
    stored_channels_ = h.channels;
    channels_ = h.channels < 3 ? 1 : h.channels > 3 && h.alpha_channel == 3 ? 4 : 3;
    uint64_t at = header_bytes + uint64_t{h.extension_bytes};
    const uint64_t constants_at = at + h.face_info_bytes, levels_at = constants_at + h.constants_bytes, data_at = levels_at + h.level_info_bytes;
    if (data_at > file_.size() || h.level_data_bytes > file_.size() - data_at) return bad("it is cut off");
    faces_.resize(h.faces);
    RAYPAGER_TRY(read_faces(at, h.face_info_bytes));
    const uint64_t texel_bytes = bytes_of_stored(kind_) * stored_channels_;
    if (texel_bytes * h.faces > max_inflation * h.constants_bytes) return bad("it has fewer mean colours than faces");
    constants_.resize(texel_bytes * h.faces);
    RAYPAGER_TRY(unpack(constants_at, h.constants_bytes, constants_));
    // The first level: all faces as they are.
    std::array<std::byte, level_bytes> level;
    RAYPAGER_TRY(file_.read(levels_at, level));
    uint64_t level_data = 0;
    uint32_t level_header = 0, level_faces = 0;
    std::memcpy(&level_data, level.data(), 8);
    std::memcpy(&level_header, &level[8], 4);
    std::memcpy(&level_faces, &level[12], 4);
    if (level_faces != h.faces || level_data > h.level_data_bytes) return bad("its first level does not have all faces");
    return read_blocks(data_at, data_at + level_data, level_header, h.faces, blocks_);
}

Status PtexFile::read_faces(uint64_t at, uint32_t packed_bytes) {
    constexpr uint8_t is_constant = 1;
    std::vector<std::byte> records(face_bytes * faces_.size());
    RAYPAGER_TRY(unpack(at, packed_bytes, records));
    for (size_t i = 0; i < faces_.size(); i++) {
        const std::byte* const record = &records[face_bytes * i];
        const auto log_width = std::to_integer<uint8_t>(record[0]), log_height = std::to_integer<uint8_t>(record[1]);
        if (log_width > max_log_texels || log_height > max_log_texels || log_width + log_height > max_log_texels)
            return bad(fmt::format("face {} has too many texels", i));
        if (!(std::to_integer<uint8_t>(record[3]) & is_constant)) faces_[i] = {log_width, log_height};
    }
    return {};
}

// A packed list of how each block is stored, and then the blocks.
Status PtexFile::read_blocks(uint64_t at, uint64_t end, uint32_t list_bytes, uint64_t count, std::vector<Block>& blocks) const {
    if (list_bytes > end - at || 4 * count > max_inflation * list_bytes) return bad("a list of blocks does not lie within it");
    std::vector<std::byte> list(4 * count);
    RAYPAGER_TRY(unpack(at, list_bytes, list));
    at += list_bytes;
    blocks.resize(count);
    for (size_t i = 0; i < count; i++) {
        uint32_t word = 0;
        std::memcpy(&word, &list[4 * i], 4);
        blocks[i] = {at, word & 0x3fffffffu, word >> 30};
        if (blocks[i].bytes > end - at) return bad(fmt::format("block {} does not lie within it", i));
        at += blocks[i].bytes;
    }
    return {};
}

Status PtexFile::unpack(uint64_t at, uint64_t packed_bytes, std::span<std::byte> content) const {
    if (content.size() > max_inflation * packed_bytes) return bad("what is packed in it is too short");
    std::vector<std::byte> packed(packed_bytes);
    RAYPAGER_TRY(file_.read(at, packed));
    uLongf size = content.size();
    const int done = uncompress(reinterpret_cast<Bytef*>(content.data()), &size, reinterpret_cast<const Bytef*>(packed.data()), packed.size());
    return done == Z_OK && size == content.size() ? Status() : bad("what is packed in it cannot be unpacked");
}

void PtexFile::keep_channels(const std::byte* from, size_t count, bool planar, std::byte* out) const {
    const size_t bytes = bytes_of_stored(kind_);
    for (size_t c = 0; c < channels_; c++)
        for (size_t i = 0; i < count; i++)
            std::memcpy(out + (i * channels_ + c) * bytes, from + (planar ? c * count + i : i * stored_channels_ + c) * bytes, bytes);
}

Status PtexFile::read_face(uint32_t face, std::vector<std::byte>& texels) const {
    const Face& size = faces_[face];
    if (size.log_width != 0 || size.log_height != 0) return read_block(blocks_[face], size, true, texels);
    texels.resize(bytes_of_stored(kind_) * channels_);
    keep_channels(&constants_[face * bytes_of_stored(kind_) * stored_channels_], 1, false, texels.data());
    return {};
}

Status PtexFile::read_block(const Block& block, const Face& size, bool may_be_tiled, std::vector<std::byte>& texels) const {
    const size_t count = size_t{1} << (size.log_width + size.log_height), texel_bytes = bytes_of_stored(kind_) * channels_;
    const size_t stored_bytes = bytes_of_stored(kind_) * stored_channels_;
    if (block.encoding == tiled) return may_be_tiled ? read_tiles(block, size, texels) : bad("a tile has tiles");
    // Before memory is taken.
    if (block.encoding != constant && count * stored_bytes > max_inflation * block.bytes) return bad("a face is too short");
    std::vector<std::byte> stored(block.encoding == constant ? stored_bytes : count * stored_bytes);
    if (block.encoding == constant) {
        if (block.bytes < stored.size()) return bad("a constant is too short");
        RAYPAGER_TRY(file_.read(block.at, stored));
        texels.resize(count * texel_bytes);
        for (size_t i = 0; i < count; i++) keep_channels(stored.data(), 1, false, &texels[i * texel_bytes]);
        return {};
    }
    RAYPAGER_TRY(unpack(block.at, block.bytes, stored));
    if (block.encoding == differences && kind_ == StoredKind::unsigned_8) sum_up<uint8_t>(stored);
    if (block.encoding == differences && kind_ == StoredKind::unsigned_16) sum_up<uint16_t>(stored);
    texels.resize(count * texel_bytes);
    keep_channels(stored.data(), count, true, texels.data());
    return {};
}

// The logarithms of a tile's size, then the bytes of a packed list of blocks, one a tile, row by row.
Status PtexFile::read_tiles(const Block& block, const Face& size, std::vector<std::byte>& texels) const {
    std::array<std::byte, 6> head;
    if (block.bytes < head.size()) return bad("a face of tiles is too short");
    RAYPAGER_TRY(file_.read(block.at, head));
    const Face tile = {std::to_integer<uint8_t>(head[0]), std::to_integer<uint8_t>(head[1])};
    if (tile.log_width > size.log_width || tile.log_height > size.log_height) return bad("tiles are larger than their face");
    uint32_t list_bytes = 0;
    std::memcpy(&list_bytes, &head[2], 4);
    const size_t across = size_t{1} << (size.log_width - tile.log_width), down = size_t{1} << (size.log_height - tile.log_height);
    std::vector<Block> tiles;
    RAYPAGER_TRY(read_blocks(block.at + head.size(), block.at + block.bytes, list_bytes, across * down, tiles));
    const size_t texel_bytes = bytes_of_stored(kind_) * channels_, row_bytes = texel_bytes << size.log_width,
                 tile_row = texel_bytes << tile.log_width;
    texels.resize(row_bytes << size.log_height);
    std::vector<std::byte> part;
    for (size_t i = 0; i < tiles.size(); i++) {
        RAYPAGER_TRY(read_block(tiles[i], tile, false, part));
        std::byte* to = &texels[(i / across << tile.log_height) * row_bytes + i % across * tile_row];
        for (size_t row = 0; row < size_t{1} << tile.log_height; row++) std::memcpy(to + row * row_bytes, &part[row * tile_row], tile_row);
    }
    return {};
}

}  // namespace raypager
