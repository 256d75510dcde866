#include "film/film.hpp"

#include <algorithm>

#include "base/check.hpp"
#include "base/hash.hpp"
#include "film/fill.hpp"
#include "film/film_sums.hpp"

namespace raypager {
namespace {

static_assert(RP_FILM_COUNT == 6 && RP_FILM_CLAMPED == 7 && RP_FILM_WORDS == 8, "three sums of two words, then the two counts");
static_assert(RP_FILM_SCALE_BITS == 28, "to_fixed_point splits at 2^4, that is at bit 32 of the sum");

template <class Visit>
void for_each_pixel(std::span<const uint32_t> words, const Visit& visit) {
    RAYPAGER_CHECK(words.size() % RP_FILM_WORDS == 0);
    for (size_t at = 0; at < words.size(); at += RP_FILM_WORDS) visit(words.subspan(at, RP_FILM_WORDS));
}

uint32_t finished_samples(std::span<const uint32_t> pixel) { return pixel[RP_FILM_COUNT] & RP_FILM_COUNT_MASK; }

// Exposure and colours as one matrix.
std::array<double, 9> response_matrix(const FilmResponse& response) {
    std::array<double, 9> matrix;
    for (size_t i = 0; i < 9; i++) matrix[i] = double{response.exposure} * response.color_matrix[i];
    return matrix;
}

// The mean stays as it is, to the bit, where the response is the identity.
void append_mean(std::span<const uint32_t> pixel, const std::array<double, 9>& response, bool alpha, std::vector<float>& values) {
    const uint32_t samples = finished_samples(pixel), misses = pixel[RP_FILM_COUNT] >> RP_FILM_MISSES_SHIFT;
    const double scale = double{1u << RP_FILM_SCALE_BITS} * samples;
    std::array<double, 3> mean = {};
    for (size_t channel = 0; channel < 3; channel++)
        if (samples != 0) mean[channel] = static_cast<double>(film_units(pixel, 2 * channel)) / scale;
    for (size_t row = 0; row < 9; row += 3)
        values.push_back(static_cast<float>(response[row] * mean[0] + response[row + 1] * mean[1] + response[row + 2] * mean[2]));
    if (alpha) values.push_back(samples == 0 ? 0.0f : 1.0f - static_cast<float>(misses) / static_cast<float>(samples));
}

uint64_t hash_of_size(uint32_t width, uint32_t height) {
    const std::array<uint32_t, 2> size{width, height};
    return hash64(std::as_bytes(std::span(size)));
}

}  // namespace

Image resolve_film(std::span<const uint32_t> words, uint32_t width, uint32_t height, const FilmResponse& response, bool alpha) {
    RAYPAGER_CHECK(words.size() == uint64_t{width} * height * RP_FILM_WORDS);
    Image image{width, height, alpha ? 4u : 3u, {}};
    image.values.reserve(uint64_t{width} * height * image.channels);
    const auto matrix = response_matrix(response);
    for_each_pixel(words, [&](std::span<const uint32_t> pixel) { append_mean(pixel, matrix, alpha, image.values); });
    return image;
}

uint64_t film_hash(std::span<const uint32_t> words, uint32_t width, uint32_t height) {
    RAYPAGER_CHECK(words.size() == uint64_t{width} * height * RP_FILM_WORDS);
    return hash64(std::as_bytes(words), hash_of_size(width, height));
}

double average_samples(std::span<const uint32_t> words) {
    if (words.empty()) return 0;
    uint64_t samples = 0;
    for_each_pixel(words, [&](std::span<const uint32_t> pixel) { samples += finished_samples(pixel); });
    const size_t pixels = words.size() / RP_FILM_WORDS;
    return static_cast<double>(samples) / static_cast<double>(pixels);
}

uint64_t clamped_samples(std::span<const uint32_t> words) {
    uint64_t samples = 0;
    for_each_pixel(words, [&](std::span<const uint32_t> pixel) { samples += pixel[RP_FILM_CLAMPED]; });
    return samples;
}

FilmResolver::FilmResolver(uint32_t width, uint32_t height, const FilmResponse& response, bool alpha, const FilmLayout& layout, FilmUse use)
    : response_(response_matrix(response)),
      use_(use),
      stride_(layout.words()),
      pixels_(uint64_t{width} * height),
      image_{width, height, alpha ? 4u : 3u, {}},
      layers_(width, height, use == FilmUse::all ? layout : FilmLayout()),
      hash_(hash_of_size(width, height)) {
    image_.values.reserve(pixels_ * image_.channels);
}

void FilmResolver::add(std::span<const uint32_t> words) {
    RAYPAGER_CHECK(words.size() % stride_ == 0 && words.size() / stride_ <= pixels_ - added_);
    const bool hashes_pixels = use_ == FilmUse::all && stride_ != RP_FILM_WORDS;
    for (size_t at = 0; at < words.size(); at += stride_) {
        const auto pixel = words.subspan(at, RP_FILM_WORDS);
        append_mean(pixel, response_, image_.channels == 4, image_.values);
        if (finished_samples(pixel) == 0) {
            unsampled_.resize(pixels_);
            unsampled_[image_.values.size() / image_.channels - 1] = true;
            unsampled_count_++;
        }
        samples_ += finished_samples(pixel);
        clamped_ += pixel[RP_FILM_CLAMPED];
        if (hashes_pixels) hash_.add(std::as_bytes(pixel));
        if (layers_.layout().layers().any()) layers_.add(words.subspan(at, stride_), finished_samples(pixel));
    }
    if (use_ == FilmUse::all && stride_ == RP_FILM_WORDS) hash_.add(std::as_bytes(words));  // at once
    added_ += words.size() / stride_;
}

Image FilmResolver::take_image() {
    RAYPAGER_CHECK(added_ == pixels_);
    if (unsampled_count_ > 0) fill_unsampled(image_, unsampled_);
    return std::move(image_);
}

std::vector<FilmLayerImage> FilmResolver::take_layers() {
    RAYPAGER_CHECK(added_ == pixels_);
    std::vector<FilmLayerImage> layers = layers_.take();
    if (unsampled_count_ > 0)
        for (FilmLayerImage& layer : layers)
            if (layer.layer == FilmLayer::albedo || layer.layer == FilmLayer::normal) fill_unsampled(layer.image, unsampled_);
    return layers;
}

uint64_t FilmResolver::hash() const {
    RAYPAGER_CHECK(added_ == pixels_ && use_ == FilmUse::all);
    return hash_.value();
}

uint64_t FilmResolver::layers_hash() const {
    RAYPAGER_CHECK(added_ == pixels_);
    return layers_.hash();
}

std::array<float, 3> limit_sample(const std::array<float, 3>& c, const FilmResponse& response) {
    const float x = 0.4124564f * c[0] + 0.3575761f * c[1] + 0.1804375f * c[2];
    const float y = 0.2126729f * c[0] + 0.7151522f * c[1] + 0.0721750f * c[2];
    const float z = 0.0193339f * c[0] + 0.1191920f * c[1] + 0.9503041f * c[2];
    const float largest = std::max({x, y, z});
    float scale = 1;
    if (y > response.max_luminance) scale = response.max_luminance / y;
    if (largest * scale > response.max_xyz) scale = response.max_xyz / largest;
    return {c[0] * scale, c[1] * scale, c[2] * scale};
}

FilmValue clamp_radiance(float radiance) {
    if (!(radiance >= 0)) return {0, true};  // negative or NaN
    if (radiance > RP_FILM_MAX_RADIANCE) return {RP_FILM_MAX_RADIANCE, true};
    return {radiance, false};
}

std::array<uint32_t, 2> to_fixed_point(float value) {
    // Exact, with v = value and the sum's unit 2^-28, so that the high word counts units of 2^-28 * 2^32 = 2^4:
    // - v * 2^-4 only changes the exponent (a subnormal result may round, but then it lies far below 1 and high is 0 either way);
    //   high = floor(v / 16) <= 2^16.
    // - high * 16 <= 2^20 is an integer of at most 17 bits: exact in float. It is v with all bits below the weight 16 cut off.
    // - So v - high * 16 is v's bits below 16: they fit into the same 24-bit significand, and the subtraction is exact.
    // - rest < 16, so rest * 2^28 < 2^32; scaling is exact again, and the conversion truncates what lies below 2^-28.
    //   Devices that flush subnormals see the same: those are below 2^-28 by far.
    const auto high = static_cast<uint32_t>(value * 0.0625f);
    const float rest = value - static_cast<float>(high) * 16.0f;
    return {static_cast<uint32_t>(rest * 268435456.0f), high};
}

void add_sample(std::span<uint32_t, RP_FILM_WORDS> pixel, const std::array<float, 3>& radiance) {
    bool clamped = false;
    for (size_t channel = 0; channel < 3; channel++) {
        const FilmValue sample = clamp_radiance(radiance[channel]);
        clamped |= sample.clamped;
        const auto [low, high] = to_fixed_point(sample.value);
        uint32_t& low_sum = pixel[2 * channel];
        low_sum += low;
        const uint32_t carry = low_sum < low ? 1 : 0;  // the unsigned sum wrapped round
        pixel[2 * channel + 1] += high + carry;
    }
    pixel[RP_FILM_COUNT]++;
    pixel[RP_FILM_CLAMPED] += clamped ? 1 : 0;
}

}  // namespace raypager
