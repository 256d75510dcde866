#include "bench/cluster_store.hpp"

#include <algorithm>
#include <functional>
#include <queue>
#include <utility>

#include "base/check.hpp"

namespace raypager::bench {

Shards divide_store(std::span<const uint32_t> block_bytes, uint32_t nodes, uint64_t host_bytes) {
    RAYPAGER_CHECK(nodes > 0);
    Shards shards;
    shards.owner.assign(block_bytes.size(), Shards::on_disk);
    shards.bytes.assign(nodes, 0);
    uint64_t all = 0;
    for (const uint32_t bytes : block_bytes) all += bytes;
    const uint64_t room = host_bytes / 4 * 3;  // of a node
    const double share = std::min(1.0, static_cast<double>(room) * nodes / static_cast<double>(std::max<uint64_t>(1, all)));
    using Use = std::pair<uint64_t, uint32_t>;  // bytes, node
    std::priority_queue<Use, std::vector<Use>, std::greater<>> least;
    for (uint32_t node = 0; node < nodes; node++) least.emplace(0, node);
    uint64_t seen = 0;
    for (size_t block = 0; block < block_bytes.size(); block++) {
        seen += block_bytes[block];
        // Of those so far, as large a part as of all.
        if (static_cast<double>(shards.bytes_in_memory + block_bytes[block]) > share * static_cast<double>(seen)) continue;
        const auto [used, node] = least.top();
        if (used + block_bytes[block] > room) continue;
        least.pop();
        least.emplace(used + block_bytes[block], node);
        shards.owner[block] = node;
        shards.bytes[node] += block_bytes[block];
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
