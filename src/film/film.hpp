// The host's side of the device film (raypager/abi/film.h): what the accumulated words mean, and how a sample must be added to them.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "base/hash.hpp"
#include "film/film_layout.hpp"
#include "film/layer_resolver.hpp"
#include "raypager/abi/film.h"
#include "raypager/picture.hpp"
#include "raypager/scene.hpp"

namespace raypager {

// words: RP_FILM_WORDS words a pixel, width * height pixels, rows from top to bottom.

// The mean of each pixel's finished samples, as the film responds to it; black where there are none. alpha: four channels, the last one the share of
// samples whose camera ray met something; the others are as without (premultiplied).
Image resolve_film(std::span<const uint32_t> words, uint32_t width, uint32_t height, const FilmResponse& response = {}, bool alpha = false);
// Fingerprint of the size and the raw words: equal films have equal hashes, on every host.
uint64_t film_hash(std::span<const uint32_t> words, uint32_t width, uint32_t height);
// Finished samples a pixel, on average.
double average_samples(std::span<const uint32_t> words);
// How many samples had a channel that was negative, NaN or above RP_FILM_MAX_RADIANCE.
uint64_t clamped_samples(std::span<const uint32_t> words);

// What is wanted of a film: all, or the picture alone, which takes less time.
enum class FilmUse { all, picture };

// All of the above for a film that comes in pieces, from the first pixel to the last: the raw film need not lie in host memory.
class FilmResolver {
public:
    FilmResolver(uint32_t width, uint32_t height, const FilmResponse& response = {}, bool alpha = false, const FilmLayout& layout = FilmLayout(),
                 FilmUse use = FilmUse::all);
    void add(std::span<const uint32_t> words);  // whole pixels, of layout.words() words each
    // REQUIRES from here on: every pixel was added.
    Image take_image();                         // pixels without samples have the colours around them (fill.hpp)
    std::vector<FilmLayerImage> take_layers();  // so do their albedos and normals, for these go with the picture
    // REQUIRES: FilmUse::all.
    uint64_t hash() const;                         // of the picture, whatever its layers
    uint64_t layers_hash() const;                  // of layers that are the same for every limit; 0: there are none
    uint64_t samples() const { return samples_; }  // finished, in all pixels together
    uint64_t clamped() const { return clamped_; }
    uint64_t unsampled() const { return unsampled_count_; }  // pixels without a finished sample

private:
    std::array<double, 9> response_;
    FilmUse use_;
    size_t stride_;  // words of a pixel
    uint64_t pixels_ = 0, added_ = 0, samples_ = 0, clamped_ = 0, unsampled_count_ = 0;
    std::vector<bool> unsampled_;  // empty while there are none
    Image image_;
    LayerResolver layers_;
    Hash64Stream hash_;
};

// A model of the kernel that accumulates ------------------------------------------------------------------------------------

// A sample as the limits of a film leave it.
std::array<float, 3> limit_sample(const std::array<float, 3>& radiance, const FilmResponse& response);

// Radiance as the film adds it: NaN and negative values are 0, values above RP_FILM_MAX_RADIANCE (infinity, too) are that.
struct FilmValue {
    float value = 0;
    bool clamped = false;  // the value was changed
};
FilmValue clamp_radiance(float radiance);

// floor(value * 2^RP_FILM_SCALE_BITS) as {low word, high word}, in float32 and 32-bit integers only.
// REQUIRES: 0 <= value <= RP_FILM_MAX_RADIANCE.
std::array<uint32_t, 2> to_fixed_point(float value);

// Adds one finished sample of linear rgb radiance to a pixel of RP_FILM_WORDS words. Integer sums, so that any order of the same samples
// ends in the same words. REQUIRES: fewer than 2^16 samples before (then 64 bits suffice whatever the values).
void add_sample(std::span<uint32_t, RP_FILM_WORDS> pixel, const std::array<float, 3>& radiance);

}  // namespace raypager
