#include "support/thread_peers.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <thread>
#include <utility>

namespace raypager::support {

class PeerThreads::Peer final : public Peers {
public:
    Peer(PeerThreads& group, uint32_t rank, uint32_t count) : group_(group), rank_(rank), count_(count) {}
    uint32_t rank() const override { return rank_; }
    uint32_t count() const override { return count_; }
    uint32_t local_count() const override { return count_; }

    Result<uint64_t> add(uint32_t number, uint64_t value) override {
        const std::lock_guard lock(group_.mutex_);
        const uint64_t before = group_.numbers_[number];
        group_.numbers_[number] += value;
        return before;
    }

    Status tell(std::vector<std::byte> bytes) override {
        const std::lock_guard lock(group_.mutex_);
        group_.told_[rank_] = std::move(bytes);
        return {};
    }

    std::vector<std::vector<std::byte>> told() const override {
        const std::lock_guard lock(group_.mutex_);
        return group_.told_;
    }

    Status broadcast(std::vector<std::byte>& bytes) override {
        if (rank_ == 0) group_.handed_[0] = bytes;
        group_.together_.arrive_and_wait();
        bytes = group_.handed_[0];
        group_.together_.arrive_and_wait();
        return {};
    }

    Result<std::vector<std::vector<std::byte>>> gather(std::span<const std::byte> bytes) override {
        group_.handed_[rank_].assign(bytes.begin(), bytes.end());
        group_.together_.arrive_and_wait();
        std::vector<std::vector<std::byte>> all;
        if (rank_ == 0) all = group_.handed_;
        group_.together_.arrive_and_wait();
        return all;
    }

    Status sum(std::span<uint32_t> words, const Add& add) override {
        group_.words_[rank_] = words;
        group_.together_.arrive_and_wait();
        if (rank_ == 0)
            for (uint32_t other = 1; other < count_; other++) add(words, group_.words_[other]);
        group_.together_.arrive_and_wait();
        return {};
    }

    void serve(Shelf* shelf) override {
        const std::lock_guard lock(mutex_);
        shelf_ = shelf;
    }

    Answer get(uint32_t rank, uint64_t number, std::span<std::byte> bytes, double seconds, const std::atomic<bool>&) override {
        return group_.peers_[rank]->answer(number, bytes, seconds);
    }

    Answer put(uint32_t rank, uint64_t number, std::vector<std::byte> bytes, const std::atomic<bool>&) override {
        return group_.peers_[rank]->take(number, bytes) ? Answer::bytes : Answer::none;
    }

    bool change_kept(uint64_t number) {
        const std::lock_guard lock(mutex_);
        std::span<const std::byte> found;
        if (!shelf_ || shelf_->find(number, found) != Answer::bytes) return false;
        const_cast<std::byte&>(found[found.size() / 3]) ^= std::byte{4};
        return true;
    }

    std::atomic<double> delay{0};  // seconds
    std::atomic<bool> damages{false}, spoils_once{false};

private:
    Answer answer(uint64_t number, std::span<std::byte> bytes, double seconds) {
        std::this_thread::sleep_for(std::chrono::duration<double>(std::min<double>(delay, seconds)));
        if (delay > seconds) return Answer::late;
        const std::lock_guard lock(mutex_);
        std::span<const std::byte> found;
        const Answer answer = shelf_ ? shelf_->find(number, found) : Answer::none;
        if (answer != Answer::bytes) return answer;
        std::ranges::copy(found, bytes.begin());
        if (damages) bytes[bytes.size() / 2] ^= std::byte{1};
        return answer;
    }

    bool take(uint64_t number, std::span<const std::byte> bytes) {
        const std::lock_guard lock(mutex_);
        if (!shelf_) return false;
        if (bytes.empty()) shelf_->will_not_come(number);
        const std::span<std::byte> room = shelf_->room_for(number);
        if (room.empty() || room.size() != bytes.size()) return false;
        std::ranges::copy(bytes, room.begin());
        if (spoils_once.exchange(false)) room[0] ^= std::byte{1};
        return shelf_->has_come(number);
    }

    PeerThreads& group_;
    const uint32_t rank_, count_;
    std::mutex mutex_;
    Shelf* shelf_ = nullptr;
};

PeerThreads::PeerThreads(uint32_t count) : together_(count), handed_(count), told_(count), words_(count) {
    for (uint32_t rank = 0; rank < count; rank++) peers_.push_back(std::make_shared<Peer>(*this, rank, count));
}

PeerThreads::~PeerThreads() = default;
Peers& PeerThreads::peer(uint32_t rank) const { return *peers_[rank]; }
std::shared_ptr<Peers> PeerThreads::shared(uint32_t rank) const { return peers_[rank]; }
void PeerThreads::make_slow(uint32_t rank, double seconds) { peers_[rank]->delay = seconds; }
bool PeerThreads::change_kept(uint32_t rank, uint64_t number) { return peers_[rank]->change_kept(number); }
void PeerThreads::spoil_once(uint32_t rank) { peers_[rank]->spoils_once = true; }
void PeerThreads::damage(uint32_t rank) { peers_[rank]->damages = true; }

}  // namespace raypager::support
