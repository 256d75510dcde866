// What check_block accepts of a damaged block can be decoded.
#pragma once

#include <gtest/gtest.h>

#include <random>

#include "block/wide_block.hpp"
#include "support/thorough.hpp"
#include "unit/bake_scenes.hpp"

namespace raypager::blocks_test {

// Changes inside a block, past its checksum: what check_block accepts can be decoded without leaving the block.
inline void decode_damaged_blocks(const std::filesystem::path& path, uint32_t seed) {
    std::mt19937 random(seed);
    const auto file = BlockFile::open(path);
    ASSERT_TRUE(file.ok());
    const BakedScene& scene = (*file)->scene();
    int refused = 0, accepted = 0;
    const int trials = support::thorough() ? 4000 : 1000;
    for (int trial = 0; trial < trials; trial++) {
        SCOPED_TRACE(testing::Message() << "seed " << seed << ", trial " << trial);
        const auto block = static_cast<uint32_t>(random() % scene.blocks.size());
        AlignedBytes bytes = read_block(**file, block);
        const auto span = bytes.span();
        // Half of the time in what comes first, header and nodes: that is where a change matters.
        const size_t reach = trial % 2 == 0 ? span.size() : std::min<size_t>(span.size(), 1024);
        for (uint32_t i = 0; i < 1 + random() % 4; i++) span[random() % reach] = static_cast<std::byte>(random());
        const Status status = (*file)->check_block(block, span);
        if (!status.ok()) {
            refused++;
            EXPECT_NE(status.message().find("good.rpb: block " + std::to_string(block)), std::string::npos);
            continue;
        }
        accepted++;
        const BlockView view(span);
        uint64_t primitives = 0;
        for (const rp_block_entry& block_entry : scene.block_entries) {
            if (block_entry.block != block) continue;
            const DecodedLeaf found = decode_subtree(view, block_entry.root);
            primitives += found.triangles.size() + found.spheres.size();
        }
        EXPECT_EQ(primitives, uint64_t{scene.blocks[block].triangles} + scene.blocks[block].spheres);
        EXPECT_FALSE(WideBlockMaker().make(span, scene.block_entries_of(block).roots).empty());
    }
    // Both must happen, or this tests nothing: vertices and boxes can change freely, references cannot.
    EXPECT_GT(refused, 100);
    EXPECT_GT(accepted, 100);
    AlignedBytes bytes = read_block(**file, 0);
    for (const size_t size : {size_t{0}, size_t{10}, sizeof(rp_block_header), bytes.size - 1})
        EXPECT_FALSE((*file)->check_block(0, bytes.span().first(size)).ok());
}

}  // namespace raypager::blocks_test
