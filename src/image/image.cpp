#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <iterator>
#include <limits>
#include <optional>

#include "base/check.hpp"
#include "base/files.hpp"
#include "image/formats.hpp"
#include "raypager/film_layers.hpp"
#include "raypager/picture.hpp"

namespace raypager {
namespace {

std::optional<ImageLibrary> image_library;

std::filesystem::path folder_of(const std::filesystem::path& path) {
    return path.parent_path().empty() ? std::filesystem::path(".") : path.parent_path();
}

Status check_writable_ending(const std::filesystem::path& path) {
    const std::string ending = lower_case_ending(path);
    if (ending == ".pfm" || (image_library && (ending == ".exr" || ending == ".png"))) return {};
    if (!image_library && (ending == ".exr" || ending == ".png"))
        return Status::usage(fmt::format("{}: this build writes no {} files (it is without OpenImageIO); use .pfm", path.string(), ending));
    return Status::usage(fmt::format("{}: cannot write pictures with the ending \"{}\"; use {}", path.string(), ending,
                                     image_library ? ".exr, .png or .pfm" : ".pfm"));
}

}  // namespace

void use_image_library(const ImageLibrary& library) { image_library = library; }
const ImageLibrary* used_image_library() { return image_library ? &*image_library : nullptr; }

std::string lower_case_ending(const std::filesystem::path& path) {
    std::string ending = path.extension().string();
    std::ranges::transform(ending, ending.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return ending;
}

Status check_image_size(const std::filesystem::path& path, uint64_t width, uint64_t height) {
    if (width == 0 || height == 0) return Status::failed(fmt::format("{}: the picture is empty ({} x {} pixels)", path.string(), width, height));
    if (width > max_image_side || height > max_image_side || width > max_image_pixels / height)
        return Status::failed(fmt::format("{}: the picture has {} x {} pixels; at most {} are accepted, and {} a side", path.string(), width, height,
                                          max_image_pixels, max_image_side));
    return {};
}

Status check_texture_size(const std::filesystem::path& path, uint64_t width, uint64_t height) {
    if (width == 0 || height == 0) return Status::failed(fmt::format("{}: the image is empty ({} x {} texels)", path.string(), width, height));
    if (width > RP_IMAGE_MAX_SIZE || height > RP_IMAGE_MAX_SIZE)
        return Status::failed(fmt::format("{}: the image has {} x {} texels; at most {} a side are accepted", path.string(), width, height,
                                          uint32_t{RP_IMAGE_MAX_SIZE}));
    return {};
}

uint8_t encode_srgb8(float linear) {
    if (!(linear > 0)) return 0;
    if (linear >= 1) return 255;
    const double v = linear;
    const double encoded = v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1 / 2.4) - 0.055;
    return static_cast<uint8_t>(std::lround(255 * encoded));
}

float decode_srgb(float encoded) {
    const double v = encoded;
    return static_cast<float>(v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4));
}

Result<Image> read_image(const std::filesystem::path& path, bool raw) {
    if (lower_case_ending(path) == ".pfm") return read_pfm(path, raw);
    if (image_library) return image_library->read(path, raw);
    return Status::failed(fmt::format("{}: this build reads only .pfm pictures (it is without OpenImageIO)", path.string()));
}

Status write_image(const std::filesystem::path& path, const Image& image) {
    RAYPAGER_CHECK(image.channels == 1 || image.channels == 3 || image.channels == 4);
    RAYPAGER_CHECK(image.values.size() == uint64_t{image.width} * image.height * image.channels);
    RAYPAGER_TRY(check_writable_ending(path));
    if (image.channels == 4 && !holds_alpha(path))
        return Status::usage(fmt::format("{}: a picture with this ending has no alpha channel; use .exr or .png", path.string()));
    RAYPAGER_TRY(check_image_size(path, image.width, image.height));
    return lower_case_ending(path) == ".pfm" ? write_pfm(path, image) : image_library->write(path, image, {});
}

Status write_image_with_layers(const std::filesystem::path& path, const Image& picture, const std::vector<FilmLayerImage>& layers) {
    if (layers.empty()) return write_image(path, picture);
    if (!holds_layers(path)) return Status::usage(fmt::format("{}: a picture with this ending has no layers; use .exr", path.string()));
    RAYPAGER_CHECK(picture.channels == 3 || picture.channels == 4);
    RAYPAGER_TRY(check_writable_ending(path));
    RAYPAGER_TRY(check_image_size(path, picture.width, picture.height));
    std::vector<std::string> channels = {"R", "G", "B"};
    if (picture.channels == 4) channels.emplace_back("A");
    std::vector<const Image*> parts = {&picture};
    for (const FilmLayerImage& layer : layers) {
        RAYPAGER_CHECK(layer.image.width == picture.width && layer.image.height == picture.height);
        std::ranges::move(film_layer_channels(layer.layer), std::back_inserter(channels));
        parts.push_back(&layer.image);
    }
    Image all{picture.width, picture.height, static_cast<uint32_t>(channels.size()), {}};
    const uint64_t pixels = uint64_t{picture.width} * picture.height;
    all.values.reserve(pixels * channels.size());
    for (uint64_t i = 0; i < pixels; i++)
        for (const Image* part : parts) {
            const auto begin = part->values.begin() + static_cast<ptrdiff_t>(i * part->channels);
            all.values.insert(all.values.end(), begin, begin + part->channels);
        }
    return image_library->write(path, all, channels);
}

bool holds_layers(const std::filesystem::path& path) { return lower_case_ending(path) == ".exr"; }

bool holds_alpha(const std::filesystem::path& path) { return lower_case_ending(path) != ".pfm"; }

void expose(Image& image, double stops) {
    if (stops == 0) return;
    const auto factor = static_cast<float>(std::exp2(stops));
    for (size_t i = 0; i < image.values.size(); i++)
        if (image.channels != 4 || i % 4 != 3) {
            constexpr float largest = std::numeric_limits<float>::max();
            image.values[i] = std::clamp(image.values[i] * factor, -largest, largest);
        }
}

Status check_writable_image(const std::filesystem::path& path) {
    RAYPAGER_TRY(check_writable_ending(path));
    std::error_code error;
    if (std::filesystem::is_directory(path, error)) return Status::usage(fmt::format("{}: is a folder; name a file in it", path.string()));
    const std::filesystem::path folder = folder_of(path);
    if (!std::filesystem::is_directory(folder, error))
        return Status::failed(fmt::format("{}: the folder {} does not exist; make it first", path.string(), folder.string()));
    if (::access(folder.c_str(), W_OK | X_OK) != 0)
        return Status::failed(fmt::format("{}: the folder {} may not be written to; choose another", path.string(), folder.string()));
    return {};
}

}  // namespace raypager
