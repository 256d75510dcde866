// From what image files hold to what images of textures are made of (ImageSource).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "raypager/scene.hpp"

namespace raypager {

enum class StoredKind { unsigned_8, unsigned_16, half, float_32 };
constexpr size_t bytes_of_stored(StoredKind kind) { return kind == StoredKind::unsigned_8 ? 1 : kind == StoredKind::float_32 ? 4 : 2; }

struct StoredTexels {
    uint32_t width = 0, height = 0;
    uint32_t channels = 1;  // 1 to 4: grey, grey and alpha, colour, colour and alpha
    StoredKind kind = StoredKind::unsigned_8;
    uint32_t largest = 0;    // of integers: what stands for 1; 0: the largest that there is
    ImageEncoding encoding;  // not automatic
    float scale = 1;         // of floats
};

class TexelConversion {
public:
    // name: of the image, for warnings.
    TexelConversion(std::string name, const StoredTexels& stored);
    const ImageShape& shape() const { return shape_; }
    // Any number of texels; what it returns is there until the next call.
    std::span<const std::byte> convert(std::span<const std::byte> stored);
    // Of what could not be kept, once all has been converted.
    void warn() const;

private:
    template <class From>
    void convert_integers(std::span<const std::byte> stored);
    void convert_floats(std::span<const std::byte> stored);
    uint16_t half_of_value(float value, bool alpha);

    const std::string name_;
    const StoredTexels stored_;
    ImageShape shape_;
    bool as_they_are_ = false;
    std::vector<uint16_t> colors_, alphas_;  // of integers: what each becomes
    std::vector<std::byte> converted_;
    uint64_t too_large_ = 0, not_numbers_ = 0;
};

}  // namespace raypager
