// Positions and ids that blocks store in few bytes come back to the bit.
#include "block/block_coding.hpp"

#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <random>

namespace raypager {
namespace {

constexpr uint32_t coding_seed = 20261125;

std::array<uint32_t, 3> bits_of(const Float3& p) { return std::bit_cast<std::array<uint32_t, 3>>(p); }

// Codes and decodes; returns the stride.
uint32_t come_back(const std::vector<Float3>& positions, float cell) {
    rp_block_header header = {};
    header.vertex_count = static_cast<rp_u32>(positions.size());
    const std::vector<std::byte> bytes = code_positions(positions, cell, header);
    EXPECT_TRUE(good_coding(header, cell));
    EXPECT_EQ(position_bytes(header), bytes.size());
    const BlockPositions decoded(header, bytes.data());
    for (size_t i = 0; i < positions.size(); i++) EXPECT_EQ(bits_of(decoded[i]), bits_of(positions[i])) << "vertex " << i << ", cell " << cell;
    return RP_POSITION_STRIDE(header.flags);
}

// Random multiples of a cell, `bits` of them along each axis, away from 0.
std::vector<Float3> lattice(std::mt19937& random, float cell, std::array<uint32_t, 3> bits, double from) {
    std::vector<Float3> positions(50);
    for (Float3& p : positions) {
        const auto coordinate = [&](uint32_t width) {
            return static_cast<float>((std::floor(from / cell) + static_cast<double>(random() & ((1u << width) - 1))) * cell);
        };
        p = {coordinate(bits[0]), coordinate(bits[1]), coordinate(bits[2])};
    }
    // So that all bits are there.
    const auto last = [&](uint32_t width) {
        return static_cast<float>((std::floor(from / cell) + static_cast<double>((uint64_t{1} << width) - 1)) * cell);
    };
    const auto first = static_cast<float>(std::floor(from / cell) * cell);
    positions[0] = {first, first, first};
    positions[1] = {last(bits[0]), last(bits[1]), last(bits[2])};
    return positions;
}

TEST(BlockCoding, positions_take_as_few_bytes_as_hold_their_bits) {
    std::mt19937 random(coding_seed);
    const struct {
        std::array<uint32_t, 3> bits;
        uint32_t stride;
    } cases[] = {{{0, 0, 0}, 4},    {{11, 11, 10}, 4}, {{11, 11, 11}, 5}, {{14, 13, 13}, 5}, {{14, 14, 13}, 6},
                 {{16, 16, 16}, 6}, {{17, 16, 16}, 8}, {{23, 20, 21}, 8}, {{22, 21, 22}, 0}, {{24, 1, 1}, 0}};
    for (const auto& c : cases) {
        SCOPED_TRACE(testing::Message() << "seed " << coding_seed << ", bits " << c.bits[0] << " " << c.bits[1] << " " << c.bits[2]);
        for (const float cell : {1.0f, 0x1p-20f, 0x1p30f})
            for (const double from : {0.0, 3.0, -5000.0})  // in cells
                EXPECT_EQ(come_back(lattice(random, cell, c.bits, from * cell), cell), c.stride);
    }
}

TEST(BlockCoding, positions_that_are_no_multiples_stay_as_they_are) {
    std::mt19937 random(coding_seed);
    std::vector<Float3> positions = lattice(random, 0.25f, {8, 8, 8}, 0);
    ASSERT_EQ(come_back(positions, 0.25f), 4u);
    EXPECT_EQ(come_back(positions, 0), 0u);
    for (const float odd : {0.3f, -0.0f, std::nextafter(1.0f, 2.0f)}) {
        positions[7].y = odd;
        EXPECT_EQ(come_back(positions, 0.25f), 0u) << odd;
    }
    EXPECT_EQ(come_back({}, 0.25f), 0u);
}

TEST(BlockCoding, cells_move_nothing_further_than_was_asked_for) {
    for (const float error : {1.0f, 0.0005f, 3e-9f, 1e-20f, 1e12f, std::nextafter(0.5f, 0.0f), std::nextafter(0.5f, 1.0f)}) {
        const float cell = position_cell(error);
        EXPECT_LE(double(cell) / 2, error);
        EXPECT_GT(double(cell), error) << "no more than needed";
        int exponent;
        EXPECT_EQ(std::frexp(cell, &exponent), 0.5f) << "a power of two";
    }
}

// ids: RP_LEAF_MAX_PRIMITIVES a leaf. Returns whether they are coded.
bool ids_come_back(const std::vector<rp_u32>& ids) {
    rp_block_header header = {};
    header.leaf_count = static_cast<rp_u32>(ids.size() / RP_LEAF_MAX_PRIMITIVES);
    const std::vector<std::byte> bytes = code_ids(ids, header);
    EXPECT_TRUE(good_coding(header, 0));
    EXPECT_EQ(id_bytes(header), bytes.size());
    EXPECT_LE(bytes.size(), ids.size() * sizeof(rp_u32));
    const BlockIds decoded(header, bytes.data());
    for (size_t i = 0; i < ids.size(); i++) {
        if (ids[i] == RP_NONE && header.flags & RP_IDS_CODED) continue;
        EXPECT_EQ(decoded(i / RP_LEAF_MAX_PRIMITIVES, i % RP_LEAF_MAX_PRIMITIVES), ids[i]) << "leaf " << i / RP_LEAF_MAX_PRIMITIVES;
    }
    return header.flags & RP_IDS_CODED;
}

// Leaves of one to four triangles, whose first ids are up to `range` from `from`, the others up to `step` from it.
std::vector<rp_u32> leaves(std::mt19937& random, uint32_t count, uint64_t from, uint64_t range, uint64_t step) {
    std::vector<rp_u32> ids;
    for (uint32_t leaf = 0; leaf < count; leaf++) {
        const uint64_t first = from + random() % range;
        const uint32_t used = 1 + random() % RP_LEAF_MAX_PRIMITIVES;
        for (uint32_t k = 0; k < RP_LEAF_MAX_PRIMITIVES; k++)
            ids.push_back(k >= used ? RP_NONE : static_cast<rp_u32>(k == 0 ? first : first + random() % (2 * step + 1) - step));
    }
    return ids;
}

// What the coding alone says of all ids must hold of each, of those that leaves do not use, too; and it says it of ids that are well below.
TEST(BlockCoding, ids_are_below_what_their_coding_says) {
    std::mt19937 random(coding_seed);
    SCOPED_TRACE(testing::Message() << "seed " << coding_seed);
    for (const uint64_t range : {1u, 50u, 700000u})
        for (const uint64_t step : {0u, 3u, 900u}) {
            const std::vector<rp_u32> ids = leaves(random, 300, 1000, range, step);
            rp_block_header header = {};
            header.leaf_count = 300;
            const std::vector<std::byte> bytes = code_ids(ids, header);
            ASSERT_TRUE(header.flags & RP_IDS_CODED);
            const BlockIds decoded(header, bytes.data());
            uint64_t least = 0;
            for (size_t i = 0; i < ids.size(); i++)
                least = std::max<uint64_t>(least, decoded(i / RP_LEAF_MAX_PRIMITIVES, i % RP_LEAF_MAX_PRIMITIVES) + uint64_t{1});
            EXPECT_FALSE(decoded.all_below(least - 1)) << range << ", " << step;
            EXPECT_TRUE(decoded.all_below(1000 + 2 * range + 8 * step + 8)) << range << ", " << step;
        }
    // Bits in which a leaf that nobody checked has any number, with a step that makes of it one below 0.
    rp_block_header header = {};
    header.leaf_count = 1;
    header.flags = RP_IDS_CODED | 4u << RP_ID_FIRST_SHIFT | 4u << RP_ID_STEP_SHIFT;
    rp_u32 words[5] = {5, static_cast<rp_u32>(-6), 0, 0, 0};
    EXPECT_FALSE(BlockIds(header, std::as_bytes(std::span(words)).data()).all_below(1u << 31));
    words[1] = static_cast<rp_u32>(-5);
    EXPECT_TRUE(BlockIds(header, std::as_bytes(std::span(words)).data()).all_below(5 + 15 + 10 + 1));
    EXPECT_FALSE(BlockIds(header, std::as_bytes(std::span(words)).data()).all_below(5 + 15 + 10));
    header.flags = 0;
    EXPECT_FALSE(BlockIds(header, std::as_bytes(std::span(words)).data()).all_below(1u << 31)) << "not coded";
}

// The corners of what coded positions may be: all numbers that have their bits are between them.
TEST(BlockCoding, positions_are_between_the_corners_of_their_coding) {
    std::mt19937 random(coding_seed);
    SCOPED_TRACE(testing::Message() << "seed " << coding_seed);
    for (const float cell : {0.25f, 0x1p-12f, 8.0f}) {
        const std::vector<Float3> positions = lattice(random, cell, {8, 9, 7}, -5000 * cell);
        rp_block_header header = {};
        const std::vector<std::byte> bytes = code_positions(positions, cell, header);
        const auto range = BlockPositions(header, bytes.data()).range();
        ASSERT_TRUE(range);
        for (const Float3& p : positions) {
            EXPECT_TRUE((*range)[0].x <= p.x && p.x <= (*range)[1].x && (*range)[0].y <= p.y && p.y <= (*range)[1].y && (*range)[0].z <= p.z &&
                        p.z <= (*range)[1].z);
            EXPECT_LE((*range)[1].x - (*range)[0].x, 255 * cell);
        }
    }
    const std::vector<Float3> odd = {{0.3f, 0, 0}};
    rp_block_header header = {};
    const std::vector<std::byte> bytes = code_positions(odd, 0, header);
    EXPECT_FALSE(BlockPositions(header, bytes.data()).range()) << "not coded";
}

TEST(BlockCoding, ids_come_back) {
    std::mt19937 random(coding_seed);
    SCOPED_TRACE(testing::Message() << "seed " << coding_seed);
    EXPECT_TRUE(ids_come_back(leaves(random, 300, 1000, 1, 0)));
    EXPECT_TRUE(ids_come_back(leaves(random, 300, 1000, 50, 3)));
    EXPECT_TRUE(ids_come_back(leaves(random, 300, 100000, 700000, 6000)));
    EXPECT_TRUE(ids_come_back(leaves(random, 300, 0xf0000000u, 0x7000000u, 100)));
    EXPECT_TRUE(ids_come_back(leaves(random, 1000, 0x80000000u, 0x70000000u, 0x8000000u)));
    // In the whole range nothing is gained.
    EXPECT_FALSE(ids_come_back(leaves(random, 300, 0x80000000u, 0x70000000u, 0x60000000u)));
    EXPECT_FALSE(ids_come_back({}));
    EXPECT_FALSE(ids_come_back({5, RP_NONE, RP_NONE, RP_NONE})) << "as many bytes";
    // Where the last bits end with a word, and where there are none: the word behind is there.
    for (const auto& [count, bits] : {std::pair(32u, 5u), std::pair(128u, 7u), std::pair(2u, 0u)}) {
        std::vector<rp_u32> single(count * RP_LEAF_MAX_PRIMITIVES, RP_NONE);
        for (uint32_t leaf = 0; leaf < count; leaf++) single[leaf * RP_LEAF_MAX_PRIMITIVES] = 7 + leaf % (1u << bits);
        EXPECT_TRUE(ids_come_back(single));
        rp_block_header header = {};
        header.leaf_count = count;
        EXPECT_EQ(code_ids(single, header).size(), (2 + count * bits / 32 + 2) * sizeof(rp_u32));
    }
    for (int trial = 0; trial < 200; trial++) {
        const uint32_t range = 1u << random() % 24, step = 1u << random() % 24;
        ids_come_back(leaves(random, 1 + random() % 100, uint64_t{1} << 25, range, step));
    }
}

TEST(BlockCoding, what_makes_no_sense_is_refused) {
    rp_block_header header = {};
    EXPECT_TRUE(good_coding(header, 0));
    const auto refused = [&](rp_u32 flags, float cell = 1) {
        rp_block_header bad = header;
        bad.flags = flags;
        return !good_coding(bad, cell);
    };
    header.upper[3] = 1;
    const auto stride = [](rp_u32 bytes) { return bytes << RP_POSITION_STRIDE_SHIFT; };
    EXPECT_FALSE(refused(stride(4) | 11 | 11 << 5 | 10 << 10));
    EXPECT_TRUE(refused(stride(4) | 11 | 11 << 5 | 11 << 10)) << "more bits than there are";
    EXPECT_TRUE(refused(11)) << "bits of floats";
    EXPECT_TRUE(refused(stride(7) | 11)) << "a stride that there is not";
    EXPECT_TRUE(refused(stride(12)));
    EXPECT_TRUE(refused(stride(4) | (RP_POSITION_MAX_BITS + 1))) << "more than a float holds";
    EXPECT_TRUE(refused(1u << 30)) << "bits that mean nothing";
    EXPECT_TRUE(refused(1u << RP_ID_FIRST_SHIFT)) << "ids that are not coded";
    EXPECT_FALSE(refused(RP_IDS_CODED | 1u << RP_ID_FIRST_SHIFT));
    EXPECT_TRUE(refused(stride(4) | 1, 2)) << "a cell of another scene";
    for (const float bad : {0.0f, -1.0f, 0.3f, 0x1p-120f, std::numeric_limits<float>::infinity(), std::numeric_limits<float>::quiet_NaN()}) {
        header.upper[3] = bad;
        EXPECT_TRUE(refused(stride(4) | 1, bad)) << bad;
        EXPECT_EQ(good_position_cell(bad), bad == 0) << bad;
    }
    header.upper[3] = 1;
    header.lower[3] = std::numeric_limits<float>::infinity();
    EXPECT_TRUE(refused(stride(4) | 1));
}

}  // namespace
}  // namespace raypager
