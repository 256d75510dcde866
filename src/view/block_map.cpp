#include "view/block_map.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace raypager {
namespace {

// A block's place in line, the first being the largest.
struct Rank {
    int urgency = 0;
    double size = 0;
    uint32_t block = 0;
    bool operator<(const Rank& other) const {
        if (urgency != other.urgency) return urgency > other.urgency;
        if (size != other.size) return size > other.size;
        return block < other.block;
    }
};

// Squares of a block's size over its distance.
double apparent_size(const Blocks& scene, uint32_t block, const std::array<float, 3>& eye) {
    const auto [lower, upper] = scene.bounds(block);
    double diagonal = 0, distance = 0;
    for (size_t a = 0; a < 3; a++) {
        const double extent = double{upper[a]} - lower[a], away = 0.5 * (double{upper[a]} + lower[a]) - eye[a];
        diagonal += extent * extent;
        distance += away * away;
    }
    return diagonal / std::max(distance, 1e-30);
}

void append_word(std::string& bytes, uint32_t word) {
    for (int shift = 0; shift < 32; shift += 8) bytes += static_cast<char>(word >> shift & 0xff);
}

uint32_t word_of(float value) {
    uint32_t word;
    std::memcpy(&word, &value, sizeof word);
    return word;
}

}  // namespace

std::vector<uint32_t> blocks_to_show(const Blocks& scene, std::span<const BlockStatus> status, const std::array<float, 3>& eye, size_t most) {
    std::vector<uint32_t> shown;
    const uint32_t first = scene.first_block_in_world(), end = static_cast<uint32_t>(status.size());
    if (end - std::min(first, end) <= most) {
        for (uint32_t block = first; block < end; block++) shown.push_back(block);
        return shown;
    }
    std::vector<Rank> ranks;
    ranks.reserve(end - first);
    for (uint32_t block = first; block < end; block++) {
        const int urgency = status[block].waiting_rays > 0 ? 2 : status[block].state == BlockStatus::State::on_its_way ? 1 : 0;
        ranks.push_back({urgency, apparent_size(scene, block, eye), block});
    }
    std::nth_element(ranks.begin(), ranks.begin() + static_cast<std::ptrdiff_t>(most), ranks.end());
    ranks.resize(most);
    for (const Rank& rank : ranks) shown.push_back(rank.block);
    return shown;
}

std::string block_records(const Blocks& scene, std::span<const BlockStatus> status, std::span<const uint32_t> shown) {
    std::string bytes;
    bytes.reserve(shown.size() * 32);
    for (const uint32_t block : shown) {
        const auto [lower, upper] = scene.bounds(block);
        for (const float value : lower) append_word(bytes, word_of(value));
        for (const float value : upper) append_word(bytes, word_of(value));
        append_word(bytes, static_cast<uint32_t>(status[block].state));
        append_word(bytes, status[block].waiting_rays);
    }
    return bytes;
}

}  // namespace raypager
