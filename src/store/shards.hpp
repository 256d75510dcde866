// Which process keeps which block in its memory: all find the same by themselves.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace raypager {

inline constexpr uint32_t no_owner = UINT32_MAX;

// Of a process's host memory for blocks: the rest is its cache, which has what is hot, whoever keeps it.
constexpr uint64_t shard_room(uint64_t host_bytes) { return host_bytes / 4 * 3; }
// Of host memory in which so many bytes have room.
constexpr uint64_t host_bytes_for_shard(uint64_t bytes) { return (bytes + 2) / 3 * 4; }

// The owner of each block, from the bytes of the blocks and the bytes that each process has room for. Neighbours go to different processes, so that
// what is in demand at a time comes from many; each gets a share of the blocks as large as its room's share of all room. Where there is too little
// room for all blocks, those without an owner are spread evenly over the rest.
std::vector<uint32_t> choose_owners(std::span<const uint32_t> block_bytes, std::span<const uint64_t> room);

}  // namespace raypager
