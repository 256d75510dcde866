// The one place that knows OpenImageIO; its exceptions end here.
#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <span>

#include "base/files.hpp"
#include "base/log.hpp"
#include "image/formats.hpp"
#include "image/openimageio_tools.hpp"
#include "raypager/picture.hpp"

namespace raypager {
namespace {

constexpr uint64_t values_at_once = uint64_t{1} << 20;  // of a picture that is not tiled, or one row
constexpr uint64_t max_values_at_once = uint64_t{1} << 26;

// Pixels are read piece by piece into an array that grows with them, so that a small damaged file that promises a huge picture fails
// before much is allocated. Values keep their stored type if raw; otherwise integers are divided by their maximum.
template <class Stored>
Status read_pixels(OIIO::ImageInput& input, const std::filesystem::path& path, OIIO::TypeDesc type, uint32_t channels, std::vector<float>& values) {
    const OIIO::ImageSpec& spec = input.spec();
    const bool tiled = spec.tile_width > 0;
    const uint64_t row = uint64_t{channels} * static_cast<uint64_t>(spec.width);
    const int step = tiled ? spec.tile_height : static_cast<int>(std::max<uint64_t>(1, values_at_once / row));
    if (step < 1 || row * static_cast<uint64_t>(std::min(step, spec.height)) > max_values_at_once)
        return Status::failed(fmt::format("{}: its tiles of {} rows are too large to be read; the file is damaged, or convert it to scan lines",
                                          path.string(), spec.tile_height));
    std::vector<Stored> rows;
    for (int y = 0; y < spec.height; y += step) {
        const int count = std::min(step, spec.height - y);
        rows.resize(row * static_cast<size_t>(count));
        const int top = spec.y + y, bottom = top + count, last_channel = static_cast<int>(channels);
        const bool good = tiled ? input.read_tiles(0, 0, spec.x, spec.x + spec.width, top, bottom, 0, 1, 0, last_channel, type, rows.data())
                                : input.read_scanlines(0, 0, top, bottom, 0, 0, last_channel, type, rows.data());
        if (!good) return Status::failed(fmt::format("{}: cannot be read: {}", path.string(), one_line(input.geterror())));
        std::ranges::transform(rows, std::back_inserter(values), [](Stored value) { return static_cast<float>(value); });
    }
    return {};
}

Status read_values(OIIO::ImageInput& input, const std::filesystem::path& path, bool raw, uint32_t channels, std::vector<float>& values) {
    const OIIO::TypeDesc type = raw ? input.spec().format : OIIO::TypeDesc(OIIO::TypeDesc::FLOAT);
    switch (type.basetype) {
        case OIIO::TypeDesc::UINT8:
            return read_pixels<uint8_t>(input, path, type, channels, values);
        case OIIO::TypeDesc::INT8:
            return read_pixels<int8_t>(input, path, type, channels, values);
        case OIIO::TypeDesc::UINT16:
            return read_pixels<uint16_t>(input, path, type, channels, values);
        case OIIO::TypeDesc::INT16:
            return read_pixels<int16_t>(input, path, type, channels, values);
        case OIIO::TypeDesc::UINT32:
            return read_pixels<uint32_t>(input, path, type, channels, values);
        case OIIO::TypeDesc::INT32:
            return read_pixels<int32_t>(input, path, type, channels, values);
        case OIIO::TypeDesc::DOUBLE:
            return read_pixels<double>(input, path, type, channels, values);
        default:
            return read_pixels<float>(input, path, OIIO::TypeDesc::FLOAT, channels, values);  // half and float
    }
}

// Display-encoded values: sRGB by what the file or its format says.
bool is_srgb(const OIIO::ImageSpec& spec) {
    const std::string space = spec.get_string_attribute("oiio:ColorSpace");
    if (!space.empty()) return OIIO::Strutil::iequals(space, "sRGB");
    return spec.format == OIIO::TypeDesc::UINT8 && spec.nchannels >= 3;
}

Result<Image> read_open(OIIO::ImageInput& input, const std::filesystem::path& path, uint64_t file_bytes, bool raw) {
    const OIIO::ImageSpec& spec = input.spec();
    if (spec.width < 0 || spec.height < 0 || spec.nchannels < 1 || spec.depth > 1)
        return Status::failed(fmt::format("{}: is not a flat picture ({} x {} x {} pixels, {} channels)", path.string(), spec.width, spec.height,
                                          spec.depth, spec.nchannels));
    RAYPAGER_TRY(check_image_size(path, static_cast<uint64_t>(spec.width), static_cast<uint64_t>(spec.height)));
    if (claims_too_much(spec, input.format_name(), file_bytes))
        return Status::failed(fmt::format("{}: claims {} x {} pixels, more than its {} bytes can hold; it is damaged or cut off", path.string(),
                                          spec.width, spec.height, file_bytes));
    Image image{static_cast<uint32_t>(spec.width), static_cast<uint32_t>(spec.height), spec.nchannels >= 3 ? 3u : 1u, {}};
    RAYPAGER_TRY(read_values(input, path, raw, image.channels, image.values));
    if (!raw && is_srgb(spec)) std::ranges::transform(image.values, image.values.begin(), decode_srgb);
    return image;
}

template <class Value>
Status encode(OIIO::ImageOutput& output, const std::filesystem::path& path, const OIIO::ImageSpec& spec, OIIO::Filesystem::IOVecOutput& memory,
              std::span<const Value> values) {
    OIIO::Filesystem::IOProxy* proxy = &memory;
    OIIO::ImageSpec with_proxy = spec;
    with_proxy.attribute("oiio:ioproxy", OIIO::TypeDesc::PTR, &proxy);
    const std::string name = path.filename().string();
    if (!output.open(name, with_proxy) || !output.write_image(spec.format, values.data()) || !output.close())
        return Status::failed(fmt::format("{}: cannot be encoded: {}", path.string(), one_line(output.geterror())));
    return {};
}

void mark_alpha(OIIO::ImageSpec& spec) {
    spec.alpha_channel = 3;
    spec.channelnames = {"R", "G", "B", "A"};
}

// PNG has colours that are not multiplied by alpha, and alpha as it is.
void encode_with_alpha(std::span<const float> values, std::span<uint8_t> bytes) {
    for (size_t i = 0; i + 3 < values.size(); i += 4) {
        const float alpha = values[i + 3];
        for (size_t channel = 0; channel < 3; channel++) bytes[i + channel] = alpha > 0 ? encode_srgb8(values[i + channel] / alpha) : uint8_t{0};
        bytes[i + 3] = static_cast<uint8_t>(std::lround(std::clamp(alpha, 0.0f, 1.0f) * 255));
    }
}

Status encode_png(OIIO::ImageOutput& output, const std::filesystem::path& path, const Image& image, OIIO::Filesystem::IOVecOutput& memory) {
    OIIO::ImageSpec spec(static_cast<int>(image.width), static_cast<int>(image.height), static_cast<int>(image.channels), OIIO::TypeDesc::UINT8);
    spec.attribute("oiio:ColorSpace", "sRGB");
    std::vector<uint8_t> bytes(image.values.size());
    std::ranges::transform(image.values, bytes.begin(), encode_srgb8);
    if (image.channels == 4) {
        mark_alpha(spec);
        spec.attribute("oiio:UnassociatedAlpha", 1);  // we divide ourselves, in linear light and before rounding
        encode_with_alpha(image.values, bytes);
    }
    const auto nans = std::ranges::count_if(image.values, [](float v) { return v != v; });
    if (nans > 0) log_warning(fmt::format("{}: {} values that are not a number are written as black", path.string(), nans));
    return encode(output, path, spec, memory, std::span<const uint8_t>(bytes));
}

Status encode_exr(OIIO::ImageOutput& output, const std::filesystem::path& path, const Image& image, const std::vector<std::string>& channels,
                  OIIO::Filesystem::IOVecOutput& memory) {
    OIIO::ImageSpec spec(static_cast<int>(image.width), static_cast<int>(image.height), static_cast<int>(image.channels), OIIO::TypeDesc::FLOAT);
    spec.attribute("oiio:ColorSpace", "Linear");
    spec.attribute("compression", "zip");
    if (image.channels == 4) mark_alpha(spec);
    if (!channels.empty()) {
        spec.channelnames = channels;
        spec.alpha_channel = channels.size() > 3 && channels[3] == "A" ? 3 : -1;
        const auto depth = std::ranges::find(channels, "Z");
        spec.z_channel = depth == channels.end() ? -1 : static_cast<int>(depth - channels.begin());
    }
    return encode(output, path, spec, memory, std::span<const float>(image.values));
}

Result<Image> read_with_openimageio(const std::filesystem::path& path, bool raw) try {
    const auto input = open_image_input(path, OIIO::ImageSpec());
    if (!input) return input.status();
    const SilentStderr silent;
    return read_open(**input, path, std::filesystem::file_size(path), raw);
} catch (const std::exception& error) {
    return Status::failed(fmt::format("{}: cannot be read: {}", path.string(), one_line(error.what())));
}

// The library encodes into memory; what reaches the disk goes through OutputFile, whole or not at all.
Status write_with_openimageio(const std::filesystem::path& path, const Image& image, const std::vector<std::string>& channels) try {
    const std::unique_ptr<OIIO::ImageOutput> output = OIIO::ImageOutput::create(path.string());
    if (!output) return Status::failed(fmt::format("{}: no writer for this ending: {}", path.string(), one_line(OIIO::geterror())));
    OIIO::Filesystem::IOVecOutput memory;
    const bool png = OIIO::Strutil::iequals(output->format_name(), "png");
    RAYPAGER_TRY(png ? encode_png(*output, path, image, memory) : encode_exr(*output, path, image, channels, memory));
    auto file = OutputFile::create(path);
    if (!file) return file.status();
    RAYPAGER_TRY(file->write(std::as_bytes(std::span<const unsigned char>(memory.buffer()))));
    return file->commit();
} catch (const std::exception& error) {
    return Status::failed(fmt::format("{}: cannot be written: {}", path.string(), one_line(error.what())));
}

}  // namespace

void use_openimageio() {
    use_image_library({read_with_openimageio, write_with_openimageio, open_rows_with_openimageio, open_embedded_rows_with_openimageio});
}

}  // namespace raypager
