#include "image/texel_conversion.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstring>

#include "base/half.hpp"
#include "base/log.hpp"
#include "base/words.hpp"
#include "image/formats.hpp"

namespace raypager {
namespace {

float linear_of(float value, const ImageEncoding& encoding) {
    if (encoding.kind == ImageEncoding::Kind::srgb) return std::copysign(decode_srgb(std::abs(value)), value);
    if (encoding.kind == ImageEncoding::Kind::gamma) return std::copysign(std::pow(std::abs(value), encoding.gamma), value);
    return value;
}

// Grey becomes a colour and a colour gets an alpha where the image needs them.
template <class From, class To, class Color, class Alpha>
void convert_texels(const std::byte* from, size_t count, uint32_t channels, To* to, const Color& color, const Alpha& alpha, To full) {
    const auto next = [&from] {
        From value;
        std::memcpy(&value, from, sizeof value);
        from += sizeof value;
        return value;
    };
    if (channels == 1) {
        for (size_t i = 0; i < count; i++) to[i] = color(next());
        return;
    }
    for (size_t i = 0; i < count; i++, to += 4) {
        to[0] = color(next());
        to[1] = channels == 2 ? to[0] : color(next());
        to[2] = channels == 2 ? to[0] : color(next());
        to[3] = channels == 3 ? full : alpha(next());
    }
}

std::vector<uint16_t> table_of_integers(size_t count, uint32_t largest, uint32_t full, const ImageEncoding& encoding) {
    std::vector<uint16_t> table(count);
    for (size_t i = 0; i < count; i++) {
        const float value = std::min(1.0f, static_cast<float>(i) / static_cast<float>(largest));
        table[i] = static_cast<uint16_t>(std::lround(linear_of(value, encoding) * static_cast<float>(full)));
    }
    return table;
}

}  // namespace

TexelConversion::TexelConversion(std::string name, const StoredTexels& stored) : name_(std::move(name)), stored_(stored) {
    using Kind = ImageEncoding::Kind;
    shape_.width = stored.width;
    shape_.height = stored.height;
    shape_.channels = stored.channels == 1 ? 1 : 4;
    shape_.has_alpha = stored.channels == 2 || stored.channels == 4;
    const bool bytes = stored.kind == StoredKind::unsigned_8;
    if (!bytes && stored.kind != StoredKind::unsigned_16) {
        shape_.kind = TexelKind::half;
        return;
    }
    // What is sRGB of 8 bits stays so.
    shape_.srgb = bytes && stored.encoding.kind == Kind::srgb;
    shape_.kind = bytes && stored.encoding.kind != Kind::gamma ? TexelKind::unsigned_8 : TexelKind::unsigned_16;
    const uint32_t full = bytes ? 255 : 65535, largest = stored.largest ? stored.largest : full;
    as_they_are_ =
        largest == full && stored.channels == shape_.channels && (bytes ? stored.encoding.kind != Kind::gamma : stored.encoding.kind == Kind::linear);
    if (as_they_are_) return;
    const ImageEncoding linear{Kind::linear, 1};
    const uint32_t new_full = shape_.kind == TexelKind::unsigned_8 ? 255 : 65535;
    colors_ = table_of_integers(size_t{full} + 1, largest, new_full, shape_.srgb ? linear : stored.encoding);
    alphas_ = table_of_integers(size_t{full} + 1, largest, new_full, linear);
}

std::span<const std::byte> TexelConversion::convert(std::span<const std::byte> stored) {
    if (as_they_are_) return stored;
    const size_t texels = stored.size() / (stored_.channels * bytes_of_stored(stored_.kind));
    converted_.resize(texels * shape_.channels * bytes_of_channel(shape_.kind));
    if (stored_.kind == StoredKind::unsigned_8)
        convert_integers<uint8_t>(stored);
    else if (stored_.kind == StoredKind::unsigned_16)
        convert_integers<uint16_t>(stored);
    else
        convert_floats(stored);
    return converted_;
}

template <class From>
void TexelConversion::convert_integers(std::span<const std::byte> stored) {
    const size_t texels = stored.size() / (stored_.channels * sizeof(From));
    const auto convert = [&]<class To>(To* to) {
        convert_texels<From>(
            stored.data(), texels, stored_.channels, to, [&](From value) { return static_cast<To>(colors_[value]); },
            [&](From value) { return static_cast<To>(alphas_[value]); }, static_cast<To>(-1));
    };
    if (shape_.kind == TexelKind::unsigned_8)
        convert(reinterpret_cast<uint8_t*>(converted_.data()));
    else
        convert(reinterpret_cast<uint16_t*>(converted_.data()));
}

uint16_t TexelConversion::half_of_value(float value, bool alpha) {
    value *= stored_.scale;
    if (std::isnan(value)) {
        not_numbers_++;
        return 0;
    }
    if (!alpha && stored_.encoding.kind != ImageEncoding::Kind::linear) value = linear_of(value, stored_.encoding);
    if (std::abs(value) > largest_half) too_large_++;
    return half_of(value);
}

void TexelConversion::convert_floats(std::span<const std::byte> stored) {
    const size_t texels = stored.size() / (stored_.channels * bytes_of_stored(stored_.kind));
    auto* halves = reinterpret_cast<uint16_t*>(converted_.data());
    const uint16_t one = half_of(1);
    if (stored_.kind == StoredKind::float_32) {
        convert_texels<float>(
            stored.data(), texels, stored_.channels, halves, [&](float value) { return half_of_value(value, false); },
            [&](float value) { return half_of_value(value, true); }, one);
        return;
    }
    // Most halves are as they shall be.
    const bool keeps = stored_.encoding.kind == ImageEncoding::Kind::linear && stored_.scale == 1;
    const auto from_half = [&](uint16_t half, bool alpha) {
        if (is_finite_half(half)) return keeps ? half : half_of_value(float_of_half(half), alpha);
        (is_nan_half(half) ? not_numbers_ : too_large_)++;
        return finite_half(half);
    };
    convert_texels<uint16_t>(
        stored.data(), texels, stored_.channels, halves, [&](uint16_t half) { return from_half(half, false); },
        [&](uint16_t half) { return from_half(half, true); }, one);
}

void TexelConversion::warn() const {
    if (not_numbers_ > 0) log_warning(fmt::format("{}: not a number, and so 0: {}", name_, counted(not_numbers_, "value")));
    if (too_large_ > 0)
        log_warning(fmt::format("{}: beyond what 16 bits hold, and so {} at most: {}", name_, largest_half, counted(too_large_, "value")));
}

}  // namespace raypager
