// The border between the stored form of a block and the form in the memory of a device class. At present one form serves both: two-wide
// nodes with 16-bit boxes, strips on shared vertices, which GPUs like best. A wider form for CPUs enters here.
#pragma once

#include <cstddef>
#include <span>

#include "raypager/status.hpp"
#include "store/block_file.hpp"

namespace raypager {

// Turns record.stored_bytes at the start of `bytes` into record.memory_bytes in the same place, in linear time.
inline Status transcode_block(std::span<std::byte> bytes, const BlockRecord& record) {
    if (record.stored_bytes != record.memory_bytes || bytes.size() < record.memory_bytes)
        return Status::failed("a block's stored form is not the one that this device reads; bake the scene again");
    return {};
}

}  // namespace raypager
