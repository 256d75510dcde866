// Where a cluster's nodes have the scene's blocks in a simulation: the shard of each in its memory, what is on disk alone, and a node's host cache.
#pragma once

#include <cstdint>
#include <list>
#include <span>
#include <unordered_map>
#include <vector>

namespace raypager::bench {

// Which node has a block in its shard, as choose_owners says (store/shards.hpp).
struct Shards {
    std::vector<uint32_t> owner;   // by block; no_owner: it stays on disk
    std::vector<uint64_t> bytes;   // by node
    uint64_t bytes_in_memory = 0;  // of all
};
// Of nodes with equal host memory.
Shards divide_store(std::span<const uint32_t> block_bytes, uint32_t nodes, uint64_t host_bytes);

// Of one node. The least recently used goes out.
class CacheModel {
public:
    explicit CacheModel(uint64_t limit) : limit_(limit) {}
    // Whether the block is there; then it has been used now.
    bool use(uint32_t block);
    // REQUIRES: it is not there. What is larger than the cache is not kept.
    void add(uint32_t block, uint64_t bytes);
    uint64_t bytes() const { return bytes_; }

private:
    struct Entry {
        uint64_t bytes;
        std::list<uint32_t>::iterator age;
    };
    uint64_t limit_, bytes_ = 0;
    std::list<uint32_t> by_age_;  // least recently used first
    std::unordered_map<uint32_t, Entry> entries_;
};

}  // namespace raypager::bench
