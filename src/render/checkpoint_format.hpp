// The fixed part of a checkpoint, as it lies on disk (CHECKPOINT.md). All numbers are little-endian; so is every machine this runs on.
#pragma once

#include <bit>
#include <cstdint>

#include "render/checkpoint.hpp"

namespace raypager::checkpoint_format {

static_assert(std::endian::native == std::endian::little, "checkpoints are read and written as they lie in memory");

inline constexpr char magic[8] = {'R', 'A', 'Y', 'P', 'C', 'K', 'P', 'T'};
inline constexpr uint32_t version = 5;
inline constexpr uint32_t endian_mark = 0x01020304u;
inline constexpr uint64_t page = 4096;  // the header takes one; sections start at multiples

struct Header {
    char magic[8];
    uint32_t version, endian_mark;
    uint64_t file_bytes;
    char program[16];  // version of the program, zeros behind it
    char device[128];  // cut off if longer, zeros behind it
    RenderIdentity identity;
    uint32_t spp, reserved;
    rp_sample_order order;
    uint64_t next_sample;
    uint64_t sample_count, samples_checksum;
    uint64_t gap_count, gaps_checksum;
    uint64_t film_words, film_checksum;
    WorkDone work;
    uint64_t checksum;  // of the bytes before it
};

static_assert(sizeof(RenderIdentity) == 160 && sizeof(WorkDone) == 128 && sizeof(rp_path_sample) == 8 && sizeof(rp_sample_order) == 16 &&
              sizeof(SampleRange) == 16);
static_assert(sizeof(Header) == 544 && offsetof(Header, checksum) == 536 && sizeof(Header) <= page);

// Gaps, samples under way, and behind them the film, on a page of its own.
constexpr uint64_t samples_offset(uint64_t gap_count) { return page + gap_count * sizeof(SampleRange); }
constexpr uint64_t film_offset(uint64_t gap_count, uint64_t sample_count) {
    return (samples_offset(gap_count) + sample_count * sizeof(rp_path_sample) + page - 1) / page * page;
}

}  // namespace raypager::checkpoint_format
