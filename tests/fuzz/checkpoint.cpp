// Checkpoints. Inputs are squeezed (tests/support/block_file_bytes.hpp); checksums and the size are made right before a try, so that what
// stands behind them is looked at as well.
#include <cstring>

#include "base/check.hpp"
#include "base/hash.hpp"
#include "fuzz/fuzz.hpp"
#include "raypager/abi/film.h"
#include "render/checkpoint_format.hpp"
#include "support/block_file_bytes.hpp"
#include "support/temporary_folder.hpp"

namespace raypager::fuzz {
namespace {

using checkpoint_format::Header;

std::string squeeze(const std::string& bytes) {
    Header header;
    std::memcpy(&header, bytes.data(), sizeof header);
    return support::squeeze_parts(bytes,
                                  {{0, sizeof header},
                                   {checkpoint_format::page, header.gap_count * sizeof(SampleRange) + header.sample_count * sizeof(rp_path_sample)},
                                   {checkpoint_format::film_offset(header.gap_count, header.sample_count), header.film_words * sizeof(uint32_t)}});
}

// The checksum of a part that lies within the file; 0 for another.
uint64_t checksum_of(const std::string& bytes, uint64_t offset, uint64_t count) {
    return offset <= bytes.size() && count <= bytes.size() - offset ? hash64(std::string_view(bytes).substr(offset, count)) : 0;
}

void seal(std::string& bytes) {
    Header header;
    std::memcpy(&header, bytes.data(), sizeof header);
    const auto at_most = [&](uint64_t count) { return std::min<uint64_t>(count, bytes.size()); };
    const uint64_t gaps = at_most(header.gap_count), samples = at_most(header.sample_count), words = at_most(header.film_words);
    header.gaps_checksum = checksum_of(bytes, checkpoint_format::page, gaps * sizeof(SampleRange));
    header.samples_checksum = checksum_of(bytes, checkpoint_format::samples_offset(gaps), samples * sizeof(rp_path_sample));
    header.film_checksum = checksum_of(bytes, checkpoint_format::film_offset(gaps, samples), words * sizeof(uint32_t));
    header.checksum = hash64(std::as_bytes(std::span(&header, 1)).first(offsetof(Header, checksum)));
    std::memcpy(bytes.data(), &header, sizeof header);
}

}  // namespace

namespace {

// In groups of so many samples a pixel, or pass by pass; begun in a row, or by several devices.
std::string seed(uint32_t together, bool gaps) {
    CheckpointState state;
    state.identity.width = 3;
    state.identity.height = 2;
    state.device = "a device";
    state.spp = 4;
    state.order = {16, together, 4, 0};
    state.samples = {{0, 1}, {gaps ? 3u : 1u, 1}};
    state.next_sample = gaps ? 10 : 8;
    if (gaps) state.gaps = {{7, 9}};
    const std::filesystem::path path = scratch_path("seed.ckpt");
    const Status written = write_checkpoint(path, state, [](uint64_t, std::span<uint32_t> words) {
        for (size_t at = RP_FILM_COUNT; at < words.size(); at += RP_FILM_WORDS) words[at] = 1;  // each pixel has one sample
        return Status();
    });
    RAYPAGER_CHECK(written.ok());
    return squeeze(support::read_file(path));
}

}  // namespace

std::vector<std::string> seeds() { return {seed(1, false), seed(4, false), seed(1, true)}; }

void run(std::string_view input) {
    std::string bytes = support::spread_pages(input);
    if (bytes.size() < sizeof(Header)) return;
    seal(bytes);
    const auto file = CheckpointFile::open(write_input("input.ckpt", bytes));
    if (!file) return RAYPAGER_CHECK(file.status().message().find("input.ckpt") != std::string::npos);
    const CheckpointState& state = file->state();
    check_proportion(state.gaps.capacity() * sizeof(SampleRange), bytes, 1);
    check_proportion(state.samples.capacity() * sizeof(rp_path_sample), bytes, 1);
    (void)file->check(RenderIdentity(), 4).ok();
    uint64_t words = 0;
    const Status read = file->read_film([&](uint64_t first, std::span<const uint32_t> piece) {
        RAYPAGER_CHECK(first == words);
        words += piece.size();
        return Status();
    });
    RAYPAGER_CHECK(!read.ok() || words == uint64_t{state.identity.width} * state.identity.height * RP_FILM_WORDS);
}

}  // namespace raypager::fuzz
