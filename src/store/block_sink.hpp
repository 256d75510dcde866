// Where a bake puts its blocks and pages: a file, or memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "block/baked_scene.hpp"
#include "raypager/status.hpp"

namespace raypager {

class BlockSink {
public:
    virtual ~BlockSink() = default;
    // Appends one block; record's offset, checksum and stored_bytes are filled in.
    virtual Status append(std::span<const std::byte> stored, BlockRecord& record) = 0;
    // Makes room for pages of images behind the blocks. REQUIRES: called once, after the last block.
    virtual Status reserve_pages(uint32_t count) = 0;
    // One of these pages, in any order, from any number of threads, each once; all of record is filled in.
    virtual Status put_page(uint32_t page, std::span<const std::byte> bytes, PageRecord& record) = 0;
    // Takes everything else; scene.blocks and scene.pages hold the records in order. REQUIRES: the last call.
    virtual Status finish(const BakedScene& scene) = 0;
};

}  // namespace raypager
