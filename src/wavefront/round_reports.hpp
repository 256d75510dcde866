// What rounds tell the host (abi/path.h, RP_REPORT_COUNT): their counters, and the blocks of which something has changed.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "device/device.hpp"
#include "raypager/abi/path.h"
#include "raypager/status.hpp"
#include "wavefront/round_counters.hpp"

namespace raypager {

class RoundReports {
public:
    static constexpr uint32_t count = 2;  // for rounds in turn
    static constexpr uint64_t bytes(uint64_t blocks) { return count * RP_REPORT_WORDS(blocks) * sizeof(uint32_t); }
    // at_once: so many blocks are read with the head, and the others where there are more: more than small scenes have, and less than is felt.
    Status allocate(Device& device, uint32_t blocks, uint32_t at_once = 4096);
    uint32_t at_once() const { return at_once_; }
    // More are read at once where there were more, and fewer again when so many rounds in a row have told of far fewer.
    static constexpr uint32_t rounds_to_forget = 64;
    const Buffer& buffer() const { return buffer_; }

    // Lets the report of this number be read when what is in the queue of kernels has been done.
    Status begin_read(uint32_t number);
    // When it has been read, as far as it is read at once; or that of the round that had the number before.
    const Event& read(uint32_t number) const { return reading_[number].read; }
    // Waits for it, and reads the rest. demand: each block once, in no order; stays as it is until the next call.
    Status finish_read(uint32_t number, RoundCounters& counters, std::span<const rp_block_demand>& demand);

private:
    // Pinned memory, so that reading does not hold up the host.
    struct Reading {
        PinnedBuffer words;
        uint32_t blocks = 0;  // that there is room for
        Event read;
    };
    void note(uint32_t told);
    Status read_rest(uint32_t number, uint32_t told, std::span<const rp_block_demand>& demand);
    uint64_t at(uint32_t number) const { return number * bytes(blocks_) / count; }

    Device* device_ = nullptr;
    Buffer buffer_;
    uint32_t blocks_ = 0;
    uint32_t at_once_ = 0, at_least_ = 0;
    uint32_t most_told_ = 0, reads_ = 0;  // of the last rounds
    std::array<Reading, count> reading_;
    std::vector<rp_block_demand> all_;  // where there were more
};

}  // namespace raypager
