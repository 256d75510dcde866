// Blocks in the memory of all processes that render together: each keeps a share of them for all. What a process does not keep itself it gets from
// the one that does, or else from the file.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <set>
#include <thread>
#include <utility>
#include <vector>

#include "raypager/peers.hpp"
#include "store/block_source.hpp"

namespace raypager {

class ShardedBlocks final : public BlockSource, private Peers::Shelf {
public:
    using Warn = std::function<void(const std::string&)>;
    // By all together. own: what this process can read by itself; outlives it, as do the peers. room: bytes of memory that it may keep blocks in.
    // Memory fills while the render goes on.
    static Result<std::unique_ptr<ShardedBlocks>> create(const BlockSource& own, Peers& peers, uint64_t room, Warn warn);
    ~ShardedBlocks() override;
    // Whoever waits for a block fails from now on, so that all can come to their end.
    void stop() { stop_ = true; }

    const BakedScene& scene() const override { return own_.scene(); }
    uint64_t held_bytes() const override { return kept_bytes_; }
    Origin origin() const override { return own_.origin(); }

    // Bytes of blocks that were asked for, by where they came from; and what went wrong.
    struct Figures {
        uint64_t kept_bytes = 0;  // in this process's memory, when all have come
        uint64_t from_memory = 0, from_peers = 0, from_file = 0;
        uint64_t late = 0, damaged = 0;  // answers of peers
    };
    Figures figures() const;
    // Whether all that it is to keep has come, or will not.
    bool is_full() const;

private:
    enum class State : uint8_t { awaited, here, failed };
    struct Kept {
        uint32_t pageable = 0;
        uint64_t at = 0;
        uint32_t bytes = 0;
        uint32_t reader = 0;  // the rank that reads it from the file
        std::atomic<State> state{State::awaited};
    };
    // Read here, for the memory of a process that cannot.
    struct Errand {
        uint32_t pageable = 0, rank = 0;
    };

    ShardedBlocks(const BlockSource& own, Peers& peers, Warn warn) : own_(own), peers_(peers), warn_(std::move(warn)) {}
    Status divide(uint64_t room);
    Status take_memory();
    void fill();
    void read_kept(Kept& kept);
    void run_errand(const Errand& errand);
    Kept* find_kept(uint64_t pageable) const;
    std::span<std::byte> bytes_of(const Kept& kept) const { return {memory_.get() + kept.at, kept.bytes}; }
    Status begin_together();
    bool is_right(uint32_t pageable, std::span<const std::byte> stored) const;
    bool take_kept(uint32_t pageable, std::span<std::byte> stored) const;
    Result<bool> take_from_owner(uint32_t pageable, std::span<std::byte> stored) const;
    Status cannot_be_had(uint32_t pageable, Peers::Answer answer) const;
    enum class Fault : uint8_t { unread, changed, damaged, late, awaited };
    void warn_once(uint32_t rank, Fault fault, const std::string& text) const;
    void warn_if_long(double begin, uint32_t rank, const std::string& what) const;

    // From wherever they come, they are compared where they are to be used; so memory, the way and the file are looked at together, once.
    Status fetch(uint32_t pageable, std::span<std::byte> stored) const override;
    bool fetches_verified() const override { return true; }
    Status damaged(uint32_t pageable, const std::string& what) const override;
    std::shared_ptr<const void> memory() const override { return memory_; }
    Peers::Answer find(uint64_t number, std::span<const std::byte>& found) override;
    std::span<std::byte> room_for(uint64_t number) override;
    bool has_come(uint64_t number) override;
    void will_not_come(uint64_t number) override;

    const BlockSource& own_;
    Peers& peers_;
    const Warn warn_;
    std::vector<uint32_t> owners_;  // by pageable
    std::shared_ptr<std::byte[]> memory_;
    uint64_t kept_bytes_ = 0;
    mutable std::vector<Kept> kept_;  // by pageable, rising
    std::vector<Errand> errands_;
    std::atomic<size_t> next_kept_{0}, next_errand_{0};
    std::atomic<bool> stop_{false};
    mutable std::mutex mutex_;
    mutable std::set<std::pair<uint32_t, Fault>> warned_;  // of which rank
    mutable std::vector<double> slow_until_;               // by rank; seconds of the steady clock
    mutable std::atomic<double> last_came_ = 0;            // anything from another rank; likewise
    mutable std::atomic<uint64_t> from_memory_{0}, from_peers_{0}, from_file_{0}, late_{0}, damaged_{0};
    std::vector<std::thread> threads_;
};

}  // namespace raypager
