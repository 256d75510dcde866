#include "texture/texel_codec.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "base/half.hpp"
#include "image/formats.hpp"
#include "raypager/sky.hpp"

namespace raypager {
namespace {

// Of a value of 0 or more, in one instruction, which lround is not.
int32_t nearest(float value) {
    const float above = value + 0.5f;
    return static_cast<int32_t>(above);
}

// In runs of a length that compilers know, which they make vectors of.
template <class Code, class Convert>
void decode_with(const Convert& convert, const std::byte* texels, size_t count, float* values) {
    constexpr size_t run = 16;
    Code codes[run];
    float converted[run];
    for (; count >= run; count -= run, texels += sizeof codes, values += run) {
        std::memcpy(codes, texels, sizeof codes);
        for (size_t k = 0; k < run; k++) converted[k] = convert(codes[k]);
        std::memcpy(values, converted, sizeof converted);
    }
    std::memcpy(codes, texels, count * sizeof(Code));
    for (size_t k = 0; k < count; k++) values[k] = convert(codes[k]);
}

// Integers are averaged as they are: their sums are exact.
template <class Code>
void decode_integers(const std::byte* texels, size_t count, float* values) {
    decode_with<Code>([](Code code) { return static_cast<float>(code); }, texels, count, values);
}

template <class Code>
void encode_integers(const float* values, size_t count, std::byte* texels) {
    for (size_t i = 0; i < count; i++) {
        const auto code = static_cast<Code>(nearest(values[i]));
        std::memcpy(texels + i * sizeof code, &code, sizeof code);
    }
}

void decode_halves(const std::byte* texels, size_t count, float* values) { decode_with<uint16_t>(float_of_half, texels, count, values); }

void encode_halves(const float* values, size_t count, std::byte* texels) {
    for (size_t i = 0; i < count; i++) {
        const uint16_t half = half_of(values[i]);
        std::memcpy(texels + i * sizeof half, &half, sizeof half);
    }
}

// To the code whose linear value is nearest as the eye sees it. In a cell of the table the codes rise by two at most.
class SrgbEncoder {
public:
    SrgbEncoder() {
        for (size_t code = 1; code < 256; code++) begins_[code] = decode_srgb((static_cast<float>(code) - 0.5f) / 255);
        std::fill(begins_.begin() + 256, begins_.end(), std::numeric_limits<float>::infinity());
        size_t code = 0;
        for (size_t cell = 0; cell <= cells; cell++) {
            while (begins_[code + 1] <= static_cast<float>(cell) / cells) code++;
            first_[cell] = static_cast<uint8_t>(code);
        }
    }
    uint8_t operator()(float linear) const {
        size_t code = first_[static_cast<size_t>(std::min(static_cast<int32_t>(linear * cells), int32_t{cells}))];
        code += linear >= begins_[code + 1];
        code += linear >= begins_[code + 1];
        return static_cast<uint8_t>(code);
    }

private:
    static constexpr int cells = 4096;
    std::array<float, 258> begins_{};  // the least linear value of a code
    std::array<uint8_t, cells + 1> first_{};
};

const SrgbEncoder& srgb_encoder() {
    static const SrgbEncoder encoder;
    return encoder;
}

void decode_srgb_gray(const std::byte* texels, size_t count, float* values) {
    const auto& linear = linear_of_srgb();
    for (size_t i = 0; i < count; i++) values[i] = linear[std::to_integer<size_t>(texels[i])];
}

void encode_srgb_gray(const float* values, size_t count, std::byte* texels) {
    const SrgbEncoder& encode = srgb_encoder();
    for (size_t i = 0; i < count; i++) texels[i] = std::byte{encode(values[i])};
}

void decode_srgb_rgba(const std::byte* texels, size_t count, float* values) {
    const auto& linear = linear_of_srgb();
    for (size_t i = 0; i < 4 * count; i += 4) {
        for (size_t channel = 0; channel < 3; channel++) values[i + channel] = linear[std::to_integer<size_t>(texels[i + channel])];
        values[i + 3] = std::to_integer<uint8_t>(texels[i + 3]);
    }
}

void encode_srgb_rgba(const float* values, size_t count, std::byte* texels) {
    const SrgbEncoder& encode = srgb_encoder();
    for (size_t i = 0; i < 4 * count; i += 4) {
        for (size_t channel = 0; channel < 3; channel++) texels[i + channel] = std::byte{encode(values[i + channel])};
        texels[i + 3] = static_cast<std::byte>(nearest(values[i + 3]));
    }
}

// Three colours and nothing.
void decode_sky(const std::byte* texels, size_t count, float* values) {
    for (size_t i = 0; i < count; i++, values += 4) {
        rp_texel texel;
        std::memcpy(&texel, texels + i * sizeof texel, sizeof texel);
        const Float3 color = texel_color(texel);
        values[0] = color.x, values[1] = color.y, values[2] = color.z, values[3] = 0;
    }
}

void encode_sky(const float* values, size_t count, std::byte* texels) {
    for (size_t i = 0; i < count; i++, values += 4) {
        const rp_texel texel = texel_of({values[0], values[1], values[2]});
        std::memcpy(texels + i * sizeof texel, &texel, sizeof texel);
    }
}

template <auto function>
void of_four(const std::byte* texels, size_t count, float* values) {
    function(texels, 4 * count, values);
}
template <auto function>
void to_four(const float* values, size_t count, std::byte* texels) {
    function(values, 4 * count, texels);
}

}  // namespace

const std::array<float, 256>& linear_of_srgb() {
    static const std::array<float, 256> table = [] {
        std::array<float, 256> values{};
        for (size_t code = 0; code < values.size(); code++) values[code] = decode_srgb(static_cast<float>(code) / 255);
        return values;
    }();
    return table;
}

TexelCodec texel_codec(uint32_t format, bool srgb) {
    switch (format) {
        case RP_TEXEL_GRAY8:
            if (srgb) return {1, decode_srgb_gray, encode_srgb_gray};
            return {1, decode_integers<uint8_t>, encode_integers<uint8_t>};
        case RP_TEXEL_GRAY16:
            return {1, decode_integers<uint16_t>, encode_integers<uint16_t>};
        case RP_TEXEL_GRAY_HALF:
            return {1, decode_halves, encode_halves};
        case RP_TEXEL_RGBA8:
            if (srgb) return {4, decode_srgb_rgba, encode_srgb_rgba};
            return {4, of_four<decode_integers<uint8_t>>, to_four<encode_integers<uint8_t>>};
        case RP_TEXEL_RGBA16:
            return {4, of_four<decode_integers<uint16_t>>, to_four<encode_integers<uint16_t>>};
        case RP_TEXEL_SKY:
            return {4, decode_sky, encode_sky};
        default:
            return {4, of_four<decode_halves>, to_four<encode_halves>};
    }
}

}  // namespace raypager
