// How a bake divides the main memory that it may use.
#pragma once

#include <cstddef>
#include <cstdint>

#include "raypager/status.hpp"

namespace raypager {

// Besides what is counted here, the program itself takes some: code, libraries, stacks. That is allowed for outside of the limit.
struct BakeMemory {
    uint64_t limit = UINT64_MAX;
    uint64_t gather = UINT64_MAX;       // a world in memory with what follows from it, until its blocks are built; and the mesh or cloud at hand
    uint64_t bucket = UINT64_MAX;       // primitives of a bucket, as Bucket::memory_bytes counts them
    uint64_t buffers = 64 << 20;        // of buckets that are filled; what is sorted into them at a time takes little besides
    uint64_t cut = UINT64_MAX;          // refs at hand while a world is cut, before there are builders
    size_t builders = SIZE_MAX;         // blocks in the making at a time
    size_t bucket_builders = SIZE_MAX;  // the same while a bucket is built: then nothing is gathered or cut
    size_t chunk_triangles = 1 << 20;   // of meshes that go to disk, in memory at a time
    size_t sample = 1 << 20;            // primitives that a partition is found on

    // An error if limit is too small; it says what would do. block_bytes: of the largest block.
    static Result<BakeMemory> plan(uint64_t limit, uint64_t block_bytes);
    // The largest block that a limit is enough for; a power of two.
    static uint64_t largest_block(uint64_t limit);
    static uint64_t smallest_limit(uint64_t block_bytes);
};

}  // namespace raypager
