// Checkpoints: what a render is between two of its rounds, in a file that appears whole or not at all. CHECKPOINT.md says byte for byte
// what it is. No device here: the film comes and goes in pieces through functions.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "base/files.hpp"
#include "raypager/abi/path.h"
#include "raypager/abi/scene.h"
#include "raypager/status.hpp"
#include "wavefront/sample_numbers.hpp"

namespace raypager {

// Everything that decides the picture, but for the number of samples. A checkpoint is good for a render that agrees in all of it.
struct RenderIdentity {
    uint64_t scene = 0;    // BakedScene::identity
    uint64_t kernels = 0;  // of those that can change it (device/kernel_tokens.hpp)
    uint32_t width = 0, height = 0, max_depth = 0, seed = 0;
    uint32_t roulette_connection = 0;
    uint32_t background = 0;  // 0: what shines there; otherwise a hash of what camera rays see instead
    rp_camera camera = {};
    uint32_t film_layers = 0;  // bits (raypager/film_layers.hpp)
    float adaptive_error = 0;  // more than 0: sampling is adaptive
};

// What was done for a picture, by all runs of the program together.
struct WorkDone {
    double render_seconds = 0, stall_seconds = 0;
    double stage_seconds[5] = {};  // wake, generate, extend, shade, connect
    uint64_t camera_rays = 0, bounce_rays = 0, shadow_rays = 0;
    uint64_t loads = 0, evictions = 0, bytes_loaded = 0, rounds = 0, requests_without_hit = 0;
    uint64_t runs = 0;
    WorkDone& operator+=(const WorkDone& more);
};

// Of a process beside rank 0, whose clock counts for all.
WorkDone without_clock(WorkDone work);

struct CheckpointState {
    RenderIdentity identity;
    std::string device;  // name and driver
    uint32_t spp = 0;    // that the render was to have
    rp_sample_order order = {1, 1, 0, 0};
    uint64_t next_sample = 0;       // all before it are in the film, in samples, or in gaps
    std::vector<SampleRange> gaps;  // not begun; sorted, apart from each other
    WorkDone work;
    std::vector<rp_path_sample> samples;  // begun, but not in the film
};

// Reads or takes words of the film from first_word on. Calls go through the film from its first word to its last.
using FilmSource = std::function<Status(uint64_t first_word, std::span<uint32_t> words)>;
using FilmTarget = std::function<Status(uint64_t first_word, std::span<const uint32_t> words)>;

// Words of a call at most: whole pixels of so many words each.
constexpr uint64_t film_piece_words(uint64_t pixel_words) { return (uint64_t{1} << 20) / pixel_words * pixel_words; }

// Of a render whose numbers end at `limit`, what it has not begun.
void set_left(CheckpointState& state, std::vector<SampleRange> left, uint64_t limit);
// The same of a checkpoint.
std::vector<SampleRange> ranges_left(const CheckpointState& state, uint64_t limit);
uint64_t samples_begun(const CheckpointState& state);

// Refuses to write a film and samples that do not add up to what was begun; the old file stays then, and after every other error.
Status write_checkpoint(const std::filesystem::path& path, const CheckpointState& state, const FilmSource& film);

class CheckpointFile {
public:
    // Reads and checks all but the film.
    static Result<CheckpointFile> open(const std::filesystem::path& path);
    const CheckpointState& state() const { return state_; }
    // Why a render of that identity and so many samples a pixel cannot go on from here; nothing if it can.
    Status check(const RenderIdentity& identity, uint32_t spp) const;
    // Hands on the film; the last call has been made before its checksum is known to be right, so nothing may be used before this is ok.
    Status read_film(const FilmTarget& target) const;

private:
    Status damaged(const std::string& what) const;
    InputFile file_;
    CheckpointState state_;
    uint64_t film_offset_ = 0, film_words_ = 0, film_checksum_ = 0;
};

}  // namespace raypager
