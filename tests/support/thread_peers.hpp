// Threads of one process that are each other's peers, as ranks of a cluster are; and can be slow, or have memory that changes.
#pragma once

#include <barrier>
#include <memory>
#include <mutex>
#include <vector>

#include "raypager/peers.hpp"

namespace raypager::support {

class PeerThreads {
public:
    explicit PeerThreads(uint32_t count);
    ~PeerThreads();
    // Each is for one thread, and lives as long as this.
    Peers& peer(uint32_t rank) const;
    std::shared_ptr<Peers> shared(uint32_t rank) const;
    // What others ask this one for comes so late from now on.
    void make_slow(uint32_t rank, double seconds);
    // What others get from this one is damaged from now on.
    void damage(uint32_t rank);
    // A byte of what this one keeps of that number changes in its memory; false: it keeps nothing of that number.
    bool change_kept(uint32_t rank, uint64_t number);
    // The next bytes that are put there arrive damaged.
    void spoil_once(uint32_t rank);

private:
    class Peer;
    std::vector<std::shared_ptr<Peer>> peers_;
    std::barrier<> together_;
    std::mutex mutex_;
    uint64_t numbers_[Peers::common_numbers] = {};
    // By rank.
    std::vector<std::vector<std::byte>> handed_, told_;
    std::vector<std::span<uint32_t>> words_;
};

}  // namespace raypager::support
