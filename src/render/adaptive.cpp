#include "render/adaptive.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "base/check.hpp"
#include "film/film_sums.hpp"
#include "raypager/abi/film.h"
#include "wavefront/sample_order.hpp"

namespace raypager {
namespace {

// Sums over the square of pixels around each, cut off at the edges of the picture: first along rows, then along columns.
std::vector<double> box_sums(const std::vector<double>& values, uint32_t width, uint32_t height, int reach) {
    std::vector<double> rows(values.size()), all(values.size());
    const auto sum_along = [&](const std::vector<double>& from, std::vector<double>& to, bool along_x) {
        for (int y = 0; y < static_cast<int>(height); y++)
            for (int x = 0; x < static_cast<int>(width); x++) {
                double sum = 0;
                for (int d = -reach; d <= reach; d++) {
                    const int at_x = along_x ? x + d : x, at_y = along_x ? y : y + d;
                    if (at_x < 0 || at_y < 0 || at_x >= static_cast<int>(width) || at_y >= static_cast<int>(height)) continue;
                    sum += from[static_cast<size_t>(at_y) * width + static_cast<size_t>(at_x)];
                }
                to[static_cast<size_t>(y) * width + static_cast<size_t>(x)] = sum;
            }
    };
    sum_along(values, rows, true);
    sum_along(rows, all, false);
    return all;
}

}  // namespace

AdaptiveSampling::AdaptiveSampling(const AdaptiveSettings& settings, const FilmLayout& layout) : settings_(settings), layout_(layout) {
    RAYPAGER_CHECK(layout.adaptive());
}

void AdaptiveSampling::take(std::span<const uint32_t> words) {
    const uint64_t pixels = uint64_t{settings_.width} * settings_.height;
    film_.reserve(pixels);
    for (size_t at = 0; at < words.size(); at += layout_.words()) {
        const std::span<const uint32_t> own = words.subspan(at + layout_.adaptive_words(), RP_ADAPTIVE_WORDS);
        film_.push_back({luminance_sum(words.subspan(at, RP_FILM_WORDS)), std::bit_cast<double>(own[0] | uint64_t{own[1]} << 32),
                         own[RP_ADAPTIVE_GRANTED], words[at + RP_FILM_COUNT] & RP_FILM_COUNT_MASK});
    }
    RAYPAGER_CHECK(film_.size() <= pixels);
}

uint32_t AdaptiveSampling::stage_end() const {
    uint32_t end = 0;
    for (const Pixel& pixel : film_) end = std::max(end, pixel.granted);
    return end;
}

uint32_t AdaptiveSampling::next_end(uint32_t end) const { return std::min(end == 0 ? 2 * first_samples : 2 * end, settings_.spp); }

// Half of the difference of the means of the samples before a stage and in it, which are as many, is about the error of the mean of both. Its square
// is averaged over a few pixels around: one pixel alone knows too little, and whoever stops where by chance it sees little would stop too dark.
//
// With n of N samples at most, a pixel may have sqrt(n / N) of the error that is asked for. So they end with numbers of samples in proportion to
// their standard deviations, which is how a given number of samples leaves the least error in the picture as a whole.
std::vector<bool> AdaptiveSampling::pixels_that_go_on(uint32_t end) const {
    // The fewer samples, the more pixels it takes to know something. Later, 5 x 5 took a quarter more samples than 3 x 3 for the same error.
    constexpr uint32_t few_samples = 64;
    const int reach = end <= few_samples ? 2 : 1;
    const uint32_t half = end / 2;
    std::vector<double> errors(film_.size()), active(film_.size());
    double mean = 0;
    for (size_t i = 0; i < film_.size(); i++) {
        const Pixel& pixel = film_[i];
        mean += pixel.sum / pixel.granted;
        if (pixel.granted != end) continue;
        const double difference = (pixel.sum - pixel.before) / (end - half) - pixel.before / half;
        errors[i] = difference * difference / 4;
        active[i] = 1;
    }
    mean /= static_cast<double>(film_.size());
    const auto sums = [&](const std::vector<double>& values) { return box_sums(values, settings_.width, settings_.height, reach); };
    const std::vector<double> error_sums = sums(errors), counts = sums(active);
    const double tolerance = settings_.error * mean;
    std::vector<bool> chosen(film_.size());
    for (size_t i = 0; i < film_.size(); i++) chosen[i] = active[i] != 0 && error_sums[i] > counts[i] * tolerance * tolerance * end / settings_.spp;
    return chosen;
}

// Every other stage goes the other way: it begins where the one before has ended, whose blocks are on the device.
void AdaptiveSampling::list_pixels(const std::vector<bool>& chosen) {
    stage_.pixels.clear();
    std::vector<std::pair<uint64_t, uint32_t>> places;
    const auto count = static_cast<size_t>(std::count(chosen.begin(), chosen.end(), true));
    places.reserve(count);
    stage_.pixels.reserve(count);
    for (uint32_t i = 0; i < chosen.size(); i++)
        if (chosen[i])
            places.emplace_back(place_in_tiles(i % settings_.width, i / settings_.width, settings_.width, settings_.height, settings_.tile_size), i);
    std::ranges::sort(places);
    if (std::bit_width(stage_.first_sample) % 2 == 0) std::ranges::reverse(places);
    for (const auto& [place, pixel] : places) stage_.pixels.push_back(pixel);
}

const SampleStage& AdaptiveSampling::next() {
    const uint32_t end = stage_end(), first = end == 0 ? std::min(first_samples, settings_.spp) : end, last = next_end(end);
    uint64_t begun = 0;
    for (const Pixel& pixel : film_) begun += pixel.granted == 0 ? first : pixel.granted;
    std::vector<bool> chosen = end == 0     ? std::vector<bool>(film_.size(), true)
                               : last > end ? pixels_that_go_on(end)
                                            : std::vector<bool>(film_.size());
    if (last <= first) chosen.assign(film_.size(), false);
    stage_ = {begun, first, last - first, {}};
    for (size_t i = 0; i < film_.size(); i++) {
        Pixel& pixel = film_[i];
        if (!chosen[i]) continue;
        pixel.before = pixel.sum;
        pixel.granted = last;
    }
    list_pixels(chosen);
    return stage_;
}

void AdaptiveSampling::put(uint64_t first_pixel, std::span<uint32_t> words) const {
    for (size_t at = 0; at < words.size(); at += layout_.words()) {
        const Pixel& pixel = film_[first_pixel++];
        const auto before = std::bit_cast<uint64_t>(pixel.before);
        const std::span<uint32_t> own = words.subspan(at + layout_.adaptive_words(), RP_ADAPTIVE_WORDS);
        own[0] = static_cast<uint32_t>(before);
        own[1] = static_cast<uint32_t>(before >> 32);
        own[RP_ADAPTIVE_GRANTED] = pixel.granted;
    }
}

bool AdaptiveSampling::is_stage_end(uint32_t samples) const {
    uint32_t end = next_end(0);
    while (end < samples && end < settings_.spp) end = next_end(end);
    return end == samples && samples > first_samples;
}

Result<SampleStage> AdaptiveSampling::resume(uint64_t next_sample) {
    const Status damaged =
        Status::failed("the film does not say which samples its pixels are to have; the checkpoint is damaged, remove it to start over");
    const uint32_t end = stage_end();
    stage_ = {};
    if (end == 0) {
        const uint64_t first_of_all = film_.size() * std::min(first_samples, settings_.spp);
        return next_sample <= first_of_all ? Result<SampleStage>(stage_) : damaged;
    }
    uint32_t first = first_samples;
    for (uint32_t stage = next_end(0); stage < end && stage < settings_.spp; stage = next_end(stage)) first = stage;
    std::vector<bool> chosen(film_.size());
    for (size_t i = 0; i < film_.size(); i++) {
        const Pixel& pixel = film_[i];
        if (!is_stage_end(pixel.granted) || pixel.finished > pixel.granted || !std::isfinite(pixel.before)) return damaged;
        chosen[i] = pixel.granted == end;
        stage_.begin += chosen[i] ? first : pixel.granted;
    }
    stage_.first_sample = first;
    stage_.passes = end - first;
    list_pixels(chosen);
    if (next_sample < stage_.begin || next_sample > stage_.end()) return damaged;
    return stage_;
}

}  // namespace raypager
