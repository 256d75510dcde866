// Where a bake puts its blocks: a file, or memory.
#pragma once

#include <cstddef>
#include <span>

#include "block/baked_scene.hpp"
#include "raypager/status.hpp"

namespace raypager {

class BlockSink {
public:
    virtual ~BlockSink() = default;
    // Appends one block; record's offset, checksum and stored_bytes are filled in.
    virtual Status append(std::span<const std::byte> stored, BlockRecord& record) = 0;
    // Takes everything else; scene.blocks holds the records in block order. REQUIRES: the last call.
    virtual Status finish(const BakedScene& scene) = 0;
};

}  // namespace raypager
