#include "wavefront/round_reports.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>

namespace raypager {
namespace {

constexpr uint64_t head_bytes = RP_REPORT_HEAD * sizeof(uint32_t);

}  // namespace

Status RoundReports::allocate(Device& device, uint32_t blocks, uint32_t at_once) {
    auto buffer = device.allocate(bytes(blocks), "reports of rounds");
    if (!buffer) return buffer.status();
    buffer_ = std::move(*buffer);
    device_ = &device;
    blocks_ = blocks;
    at_once_ = at_least_ = std::min(blocks, at_once);
    return {};
}

Status RoundReports::begin_read(uint32_t number) {
    Reading& reading = reading_[number];
    const uint64_t bytes = head_bytes + uint64_t{at_once_} * sizeof(rp_block_demand);
    if (reading.words.bytes().size() < bytes) {
        auto words = device_->allocate_pinned(bytes);
        if (!words) return words.status();
        reading.words = std::move(*words);
    }
    reading.blocks = at_once_;
    return device_->kernels().read(buffer_, at(number), reading.words.bytes().first(bytes), &reading.read);
}

Status RoundReports::finish_read(uint32_t number, RoundCounters& counters, std::span<const rp_block_demand>& demand) {
    const Reading& reading = reading_[number];
    RAYPAGER_TRY(reading.read.wait());
    const std::span<const std::byte> words = reading.words.bytes();
    std::memcpy(counters.words.data(), words.data(), sizeof counters.words);
    uint32_t told = 0;
    std::memcpy(&told, words.data() + RP_REPORT_COUNT * sizeof(uint32_t), sizeof told);
    if (told > blocks_) return Status::failed(fmt::format("a round tells of {} blocks, but there are {}; this is a bug", told, blocks_));
    demand = {reinterpret_cast<const rp_block_demand*>(words.data() + head_bytes), std::min(told, reading.blocks)};
    if (told > reading.blocks) RAYPAGER_TRY(read_rest(number, told, demand));
    note(told);
    const bool sound = std::ranges::all_of(demand, [this](const rp_block_demand& of_block) { return of_block.block < blocks_; });
    return sound ? Status() : Status::failed(fmt::format("a round tells of blocks that there are not, beyond {}; this is a bug", blocks_));
}

// The first rounds of a render may tell of nearly all blocks, and each read takes the bus.
void RoundReports::note(uint32_t told) {
    most_told_ = std::max(most_told_, told);
    if (++reads_ < rounds_to_forget) return;
    if (most_told_ < at_once_ / 4) at_once_ = std::max(at_least_, 2 * most_told_);
    most_told_ = reads_ = 0;
}

Status RoundReports::read_rest(uint32_t number, uint32_t told, std::span<const rp_block_demand>& demand) {
    // From now on twice as many are read at once, so that this is seldom: it waits for what is in the queue.
    at_once_ = static_cast<uint32_t>(std::min<uint64_t>(2 * uint64_t{told}, blocks_));
    all_.resize(told);
    std::copy(demand.begin(), demand.end(), all_.begin());
    const std::span<rp_block_demand> rest = std::span(all_).subspan(demand.size());
    RAYPAGER_TRY(device_->kernels().read_now(buffer_, at(number) + head_bytes + demand.size_bytes(), std::as_writable_bytes(rest)));
    demand = all_;
    return {};
}

}  // namespace raypager
