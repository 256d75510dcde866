// Adaptive sampling: which pixels get more samples (RenderOptions::adaptive_error). Samples are begun in stages, each of which gives a pixel as many
// samples as it has. Between two stages no path is under way, and the film alone decides who goes on, in whole numbers and plain arithmetic on the
// host. So the picture is the same to the bit whatever the limits are, and after a stop in the middle of a stage.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "film/film_layout.hpp"
#include "raypager/status.hpp"

namespace raypager {

// Samples first_sample to first_sample + passes - 1 of some pixels, numbered from `begin` on, those of a pixel one after the other.
struct SampleStage {
    uint64_t begin = 0;
    uint32_t first_sample = 0, passes = 0;
    std::vector<uint32_t> pixels;
    uint64_t end() const { return begin + uint64_t{passes} * pixels.size(); }
};

struct AdaptiveSettings {
    double error = 0;
    uint32_t width = 0, height = 0, spp = 0;  // spp: at most
    uint32_t tile_size = 1;                   // pixels of a stage follow each other tile by tile, since rays close together meet the same blocks
};

class AdaptiveSampling {
public:
    // So many samples each pixel gets, in the order of rp_sample_order, before the first stage.
    static constexpr uint32_t first_samples = 8;
    // Of main memory, at most.
    static constexpr uint64_t bytes_per_pixel = 96;

    AdaptiveSampling(const AdaptiveSettings& settings, const FilmLayout& layout);

    // Between two stages: all words of the film come in, from the first pixel to the last, then next() says what follows, and put() what of the
    // film is to be changed for it. The first stage is that of all pixels.
    void begin_taking() { film_.clear(); }
    void take(std::span<const uint32_t> words);
    // Without pixels: the picture is finished.
    const SampleStage& next();
    void put(uint64_t first_pixel, std::span<uint32_t> words) const;
    // In the middle of a stage, when a render goes on from a checkpoint whose next sample has this number: take() as before, then the stage. No
    // pixels and no passes: it is still in its first samples. An error if the film says what no render has left there.
    Result<SampleStage> resume(uint64_t next_sample);

private:
    struct Pixel {
        double sum = 0, before = 0;  // of luminance: of all samples, and of those before the stage
        uint32_t granted = 0;        // samples that it is to have at the end of the stage
        uint32_t finished = 0;       // that it has
    };
    uint32_t stage_end() const;
    uint32_t next_end(uint32_t end) const;
    bool is_stage_end(uint32_t samples) const;
    std::vector<bool> pixels_that_go_on(uint32_t end) const;
    void list_pixels(const std::vector<bool>& chosen);

    AdaptiveSettings settings_;
    FilmLayout layout_;
    std::vector<Pixel> film_;
    SampleStage stage_;
};

}  // namespace raypager
