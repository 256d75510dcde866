#include "bench/cluster_store.hpp"

#include <iterator>

#include "base/check.hpp"
#include "store/shards.hpp"

namespace raypager::bench {

Shards divide_store(std::span<const uint32_t> block_bytes, uint32_t nodes, uint64_t host_bytes) {
    RAYPAGER_CHECK(nodes > 0);
    Shards shards;
    shards.owner = choose_owners(block_bytes, std::vector<uint64_t>(nodes, shard_room(host_bytes)));
    shards.bytes.assign(nodes, 0);
    for (size_t block = 0; block < block_bytes.size(); block++) {
        if (shards.owner[block] == no_owner) continue;
        shards.bytes[shards.owner[block]] += block_bytes[block];
        shards.bytes_in_memory += block_bytes[block];
    }
    return shards;
}

bool CacheModel::use(uint32_t block) {
    const auto found = entries_.find(block);
    if (found == entries_.end()) return false;
    by_age_.splice(by_age_.end(), by_age_, found->second.age);
    return true;
}

void CacheModel::add(uint32_t block, uint64_t bytes) {
    if (bytes > limit_) return;
    while (bytes_ + bytes > limit_) {
        const auto oldest = entries_.find(by_age_.front());
        bytes_ -= oldest->second.bytes;
        entries_.erase(oldest);
        by_age_.pop_front();
    }
    by_age_.push_back(block);
    entries_.emplace(block, Entry{bytes, std::prev(by_age_.end())});
    bytes_ += bytes;
}

}  // namespace raypager::bench
