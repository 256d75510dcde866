#include "block/block_coding.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

namespace raypager {
namespace {

constexpr size_t triangles = RP_LEAF_MAX_PRIMITIVES;

constexpr auto axes = {&Float3::x, &Float3::y, &Float3::z};

template <class Header>
auto& base_of(Header& header, int axis) {
    return axis == 0 ? header.origin[3] : axis == 1 ? header.cell[3] : header.lower[3];
}

uint32_t position_bits(rp_u32 flags) { return RP_POSITION_BITS(flags, 0) + RP_POSITION_BITS(flags, 1) + RP_POSITION_BITS(flags, 2); }

template <class T>
std::vector<std::byte> whole(std::span<const T> items) {
    const auto bytes = std::as_bytes(items);
    return {bytes.begin(), bytes.end()};
}

}  // namespace

float position_cell(float error) {
    int exponent;
    std::frexp(2 * double(error), &exponent);
    return static_cast<float>(std::ldexp(1.0, exponent - 1));
}

// Products with a power of two are exact unless they are too small for normal numbers, so that it makes no difference whether a device fuses the sum.
bool good_position_cell(float cell) {
    int exponent;
    return cell == 0 || (cell >= 0x1p-100f && cell <= 0x1p60f && std::frexp(cell, &exponent) == 0.5f);
}

uint64_t position_bytes(const rp_block_header& header) {
    const uint64_t stride = RP_POSITION_STRIDE(header.flags);
    return header.vertex_count * (stride ? stride : sizeof(Float3));
}

uint64_t attribute_bytes(const rp_block_header& header) {
    const uint64_t uvs = RP_BLOCK_HAS_UVS(header.attributes_at) ? sizeof(Float2) * uint64_t{header.vertex_count} : 0;
    return uvs_at(header) + uvs - RP_BLOCK_ATTRIBUTES_AT(header.attributes_at);
}

uint64_t colors_at(const rp_block_header& header) {
    return RP_BLOCK_ATTRIBUTES_AT(header.attributes_at) + (header.flags & RP_BLOCK_NORMALS ? sizeof(rp_u32) * uint64_t{header.vertex_count} : 0);
}

uint64_t uvs_at(const rp_block_header& header) {
    const uint64_t words = (header.flags & RP_BLOCK_NORMALS ? 1 : 0) + (header.flags & RP_BLOCK_COLORS ? 1 : 0);
    return RP_BLOCK_ATTRIBUTES_AT(header.attributes_at) + words * sizeof(rp_u32) * header.vertex_count;
}

uint64_t leaf_bytes(const rp_block_header& header) {
    return header.leaf_count * uint64_t{holds_instances(header) ? sizeof(rp_instance) + sizeof(rp_u32) : sizeof(rp_leaf)};
}

uint64_t id_bytes(const rp_block_header& header) {
    const uint64_t leaves = holds_instances(header) ? 0 : header.leaf_count;
    if (!(header.flags & RP_IDS_CODED)) return leaves * triangles * sizeof(rp_u32);
    return sizeof(rp_u32) * (2 + leaves * id_bits_of_leaf(header.flags) / 32 + 2);
}

bool good_coding(const rp_block_header& header, float scene_cell) {
    const rp_u32 flags = header.flags, stride = RP_POSITION_STRIDE(flags);
    static_assert((RP_POSITION_ALL_BITS | 15u << RP_POSITION_STRIDE_SHIFT | RP_IDS_ALL_BITS | RP_BLOCK_NORMALS | RP_BLOCK_COLORS) == ~0u);
    const bool any_attribute = (flags & (RP_BLOCK_NORMALS | RP_BLOCK_COLORS)) != 0 || RP_BLOCK_HAS_UVS(header.attributes_at);
    if ((RP_BLOCK_ATTRIBUTES_AT(header.attributes_at) != 0) != any_attribute) return false;
    if (!(flags & RP_IDS_CODED) && flags & RP_IDS_ALL_BITS) return false;
    const float cell = header.upper[3];
    if (stride == 0) return (flags & RP_POSITION_ALL_BITS) == 0;
    if ((stride != 4 && stride != 5 && stride != 6 && stride != 8) || position_bits(flags) > 8 * stride) return false;
    if (cell == 0 || cell != scene_cell || !good_position_cell(cell)) return false;
    for (int a = 0; a < 3; a++) {
        const uint32_t bits = RP_POSITION_BITS(flags, a);
        const float base = base_of(header, a);
        if (bits > RP_POSITION_MAX_BITS || !std::isfinite(base) || !std::isfinite(base + static_cast<float>((1u << bits) - 1) * cell)) return false;
    }
    return true;
}

Float3 BlockPositions::decode(size_t index) const {
    uint64_t word = 0;
    std::memcpy(&word, section_ + index * stride_, stride_);
    Float3 position = base_;
    int axis = 0;
    for (const auto coordinate : axes) {
        const uint32_t bits = RP_POSITION_BITS(flags_, axis++);
        // The product is exact, and so is the sum where positions were baked.
        position.*coordinate += static_cast<float>(word & ((uint64_t{1} << bits) - 1)) * cell_;
        word >>= bits;
    }
    return position;
}

std::optional<std::array<Float3, 2>> BlockPositions::range() const {
    if (stride_ == 0) return std::nullopt;
    Float3 last = base_;
    int axis = 0;
    for (const auto coordinate : axes) last.*coordinate += static_cast<float>((1u << RP_POSITION_BITS(flags_, axis++)) - 1) * cell_;
    return {{base_, last}};
}

bool BlockIds::all_below(uint64_t count) const {
    if (!coded_) return false;
    const auto most = [](uint32_t width) { return (int64_t{1} << width) - 1; };
    const int64_t first = word(0), step = static_cast<int32_t>(word(1));
    return first + std::min<int64_t>(step, 0) >= 0 &&
           first + most(first_bits_) + std::max<int64_t>(step + most(step_bits_), 0) < static_cast<int64_t>(count);
}

std::vector<std::byte> code_positions(std::span<const Float3> positions, float cell, rp_block_header& header) {
    header.flags &= RP_IDS_ALL_BITS;
    for (int a = 0; a < 3; a++) base_of(header, a) = 0;
    header.upper[3] = 0;
    if (positions.empty() || !(cell > 0)) return whole(positions);

    Float3 base = positions[0], last = positions[0];
    for (const Float3& p : positions)
        for (const auto coordinate : axes) {
            base.*coordinate = std::min(base.*coordinate, p.*coordinate);
            last.*coordinate = std::max(last.*coordinate, p.*coordinate);
        }
    rp_block_header coded = header;
    coded.upper[3] = cell;
    uint32_t bits = 0;
    int axis = 0;
    for (const auto coordinate : axes) {
        const double most = (double(last.*coordinate) - base.*coordinate) / cell;
        if (!(most < double(1u << RP_POSITION_MAX_BITS))) return whole(positions);
        const auto width = static_cast<uint32_t>(std::bit_width(static_cast<uint32_t>(most)));
        coded.flags |= width << 5 * axis;
        base_of(coded, axis++) = base.*coordinate;
        bits += width;
    }
    if (bits > 64) return whole(positions);
    const size_t stride = bits <= 32 ? 4 : bits <= 40 ? 5 : bits <= 48 ? 6 : 8;
    coded.flags |= static_cast<rp_u32>(stride) << RP_POSITION_STRIDE_SHIFT;

    std::vector<std::byte> bytes(positions.size() * stride);
    for (size_t i = 0; i < positions.size(); i++) {
        uint64_t word = 0;
        uint32_t shift = 0;
        axis = 0;
        for (const auto coordinate : axes) {
            const double offset = (double(positions[i].*coordinate) - base.*coordinate) / cell;
            word |= static_cast<uint64_t>(offset) << shift;
            shift += RP_POSITION_BITS(coded.flags, axis++);
        }
        std::memcpy(bytes.data() + i * stride, &word, stride);
    }
    // By their bits: -0 is none of those that come back.
    const BlockPositions decoded(coded, bytes.data());
    for (size_t i = 0; i < positions.size(); i++)
        if (std::bit_cast<std::array<uint32_t, 3>>(decoded[i]) != std::bit_cast<std::array<uint32_t, 3>>(positions[i])) return whole(positions);
    header = coded;
    return bytes;
}

std::vector<std::byte> code_ids(std::span<const rp_u32> ids, rp_block_header& header) {
    header.flags &= ~RP_IDS_ALL_BITS;
    const size_t leaves = ids.size() / triangles;
    if (leaves == 0) return {};
    rp_u32 least_first = RP_NONE, most_first = 0;
    int64_t min_step = INT64_MAX, max_step = INT64_MIN;
    for (size_t i = 0; i < ids.size(); i++) {
        if (i % triangles == 0) {
            least_first = std::min(least_first, ids[i]);
            most_first = std::max(most_first, ids[i]);
        } else if (ids[i] != RP_NONE) {
            const int64_t step = int64_t{ids[i]} - ids[i / triangles * triangles];
            min_step = std::min(min_step, step);
            max_step = std::max(max_step, step);
        }
    }
    if (min_step > max_step) min_step = max_step = 0;
    const auto first_bits = static_cast<rp_u32>(std::bit_width(most_first - least_first));
    const auto step_bits = static_cast<rp_u32>(std::bit_width(static_cast<uint64_t>(max_step - min_step)));
    rp_block_header coded = header;
    if (first_bits > RP_ID_MAX_BITS || step_bits > RP_ID_MAX_BITS) return whole(ids);
    coded.flags |= RP_IDS_CODED | first_bits << RP_ID_FIRST_SHIFT | step_bits << RP_ID_STEP_SHIFT;
    if (id_bytes(coded) >= ids.size_bytes()) return whole(ids);
    header = coded;

    std::vector<rp_u32> words(id_bytes(header) / sizeof(rp_u32));
    words[0] = least_first;
    words[1] = static_cast<rp_u32>(min_step);
    size_t at = 64;
    const auto put = [&](rp_u32 value, uint32_t width) {
        const uint64_t both = uint64_t{value} << at % 32;
        words[at / 32] |= static_cast<rp_u32>(both);
        words[at / 32 + 1] |= static_cast<rp_u32>(both >> 32);
        at += width;
    };
    for (size_t leaf = 0; leaf < leaves; leaf++) {
        const auto of_leaf = ids.subspan(leaf * triangles, triangles);
        put(of_leaf[0] - least_first, first_bits);
        for (size_t k = 1; k < triangles; k++)
            put(of_leaf[k] == RP_NONE ? 0 : static_cast<rp_u32>(int64_t{of_leaf[k]} - of_leaf[0] - min_step), step_bits);
    }
    return whole(std::span<const rp_u32>(words));
}

}  // namespace raypager
