#include "store/shards.hpp"

#include <algorithm>
#include <numeric>
#include <queue>

namespace raypager {

std::vector<uint32_t> choose_owners(std::span<const uint32_t> block_bytes, std::span<const uint64_t> room) {
    struct Owner {
        double used_share;
        uint32_t rank;
        bool operator<(const Owner& other) const {  // the least used is on top
            return used_share != other.used_share ? used_share > other.used_share : rank > other.rank;
        }
    };
    std::priority_queue<Owner> owners;
    for (uint32_t rank = 0; rank < room.size(); rank++)
        if (room[rank] > 0) owners.push({0, rank});
    const auto all_bytes = std::accumulate(block_bytes.begin(), block_bytes.end(), 0.0);
    const double fits = all_bytes > 0 ? std::min(1.0, std::accumulate(room.begin(), room.end(), 0.0) / all_bytes) : 1;
    std::vector<uint64_t> used(room.size());
    std::vector<uint32_t> owner_of(block_bytes.size(), no_owner);
    const uint32_t smallest = block_bytes.empty() ? 0 : *std::min_element(block_bytes.begin(), block_bytes.end());
    double due = 0;  // bytes that should have an owner by now, and have none
    for (size_t block = 0; block < block_bytes.size() && !owners.empty(); block++) {
        due += fits * block_bytes[block];
        if (fits < 1 && due < block_bytes[block]) continue;
        std::vector<Owner> too_full;  // for this one
        for (bool found = false; !found && !owners.empty();) {
            const Owner owner = owners.top();
            const uint64_t left = room[owner.rank] - used[owner.rank];
            owners.pop();
            found = left >= block_bytes[block];
            if (!found && left >= smallest) too_full.push_back(owner);
            if (!found) continue;
            used[owner.rank] += block_bytes[block];
            owners.push({static_cast<double>(used[owner.rank]) / static_cast<double>(room[owner.rank]), owner.rank});
            owner_of[block] = owner.rank;
            due -= block_bytes[block];
        }
        for (const Owner& owner : too_full) owners.push(owner);
    }
    return owner_of;
}

}  // namespace raypager
