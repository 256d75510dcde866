#include "world/bake_memory.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <iterator>

#include "base/parallel.hpp"
#include "base/words.hpp"
#include "world/records.hpp"

namespace raypager {
namespace {

// What building a block takes, in bytes of the block: its tree and vertices before they are packed, the tree of its
// wide form, which is measured, and two packed blocks that wait for their turn.
constexpr uint64_t builder_bytes_of_block = 16;
// Of the limit for all builders together.
constexpr uint64_t builders_share = 4;
// Of those beside a bucket, which has a half.
constexpr uint64_t bucket_builders_eighths = 3;
// Triangles of a bucket have their own vertices, which must have numbers.
constexpr uint64_t max_bucket = uint64_t{RP_NONE} / 3 * *std::min_element(std::begin(record_memory), std::begin(record_memory) + sphere_records + 1);
constexpr uint64_t min_limit = uint64_t{16} << 20;
// A triangle of a chunk: indices, corners, where they come from, records.
constexpr uint64_t chunk_bytes_of_triangle = 12 + 3 * sizeof(VertexBits) + 12 + sizeof(TexturedTriangleRecord);

}  // namespace

uint64_t BakeMemory::smallest_limit(uint64_t block_bytes) { return std::max(min_limit, builders_share * builder_bytes_of_block * block_bytes); }

uint64_t BakeMemory::largest_block(uint64_t limit) {
    return std::bit_floor(std::max<uint64_t>(1, limit / (builders_share * builder_bytes_of_block)));
}

Result<BakeMemory> BakeMemory::plan(uint64_t limit, uint64_t block_bytes) {
    const uint64_t smallest = smallest_limit(block_bytes);
    if (limit < smallest)
        return Status::usage(fmt::format("a host limit of {} is too small to bake blocks of up to {}; the smallest that would do is {}",
                                         format_bytes(limit), format_bytes(block_bytes), format_exact_bytes(smallest)));
    BakeMemory memory;
    memory.limit = limit;
    const auto builders_in = [&](uint64_t bytes) {
        return static_cast<size_t>(std::clamp<uint64_t>(bytes / (builder_bytes_of_block * block_bytes), 1, worker_count()));
    };
    memory.builders = builders_in(limit / builders_share);
    memory.bucket_builders = builders_in(limit / 8 * bucket_builders_eighths);
    memory.gather = limit - memory.builders * builder_bytes_of_block * block_bytes;
    memory.bucket = std::min(limit / 2, max_bucket);
    memory.cut = limit / builders_share;
    memory.buffers = limit / 2;
    memory.chunk_triangles = static_cast<size_t>(std::clamp<uint64_t>(limit / 4 / chunk_bytes_of_triangle, 1 << 12, 1 << 20));
    memory.sample = static_cast<size_t>(std::clamp<uint64_t>(limit / 8 / 32, 1 << 12, 1 << 20));
    return memory;
}

}  // namespace raypager
