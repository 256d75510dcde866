// Images of textures through OpenImageIO.
#include <OpenImageIO/imageio.h>
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <exception>
#include <optional>
#include <string_view>
#include <vector>

#include "image/openimageio_tools.hpp"
#include "image/texel_conversion.hpp"

namespace raypager {
namespace {

constexpr uint64_t bytes_at_once = uint64_t{4} << 20;  // of an image that is not tiled, or one row
constexpr uint64_t most_bytes_at_once = uint64_t{256} << 20;

StoredKind kind_of(const OIIO::ImageSpec& spec) {
    switch (spec.format.basetype) {
        case OIIO::TypeDesc::UINT8:
            return StoredKind::unsigned_8;
        case OIIO::TypeDesc::UINT16:
            return StoredKind::unsigned_16;
        case OIIO::TypeDesc::HALF:
            return StoredKind::half;
        default:
            return StoredKind::float_32;  // others come as shares of their largest
    }
}

OIIO::TypeDesc type_of(StoredKind kind) {
    switch (kind) {
        case StoredKind::unsigned_8:
            return OIIO::TypeDesc::UINT8;
        case StoredKind::unsigned_16:
            return OIIO::TypeDesc::UINT16;
        case StoredKind::half:
            return OIIO::TypeDesc::HALF;
        default:
            return OIIO::TypeDesc::FLOAT;
    }
}

// What the file says of its values, if it does: "sRGB", "Linear", "lin_srgb", "GammaCorrected2.2".
std::optional<ImageEncoding> encoding_of(const OIIO::ImageSpec& spec) {
    using Kind = ImageEncoding::Kind;
    const std::string space = OIIO::Strutil::lower(spec.get_string_attribute("oiio:ColorSpace"));
    if (space.empty()) return std::nullopt;
    if (OIIO::Strutil::starts_with(space, "srgb")) return ImageEncoding{Kind::srgb, 1};
    if (OIIO::Strutil::contains(space, "lin")) return ImageEncoding{Kind::linear, 1};
    if (!OIIO::Strutil::starts_with(space, "gamma")) return std::nullopt;
    const size_t digits = space.find_first_of("0123456789");
    float gamma = 0;
    if (digits == std::string::npos || std::from_chars(space.data() + digits, space.data() + space.size(), gamma).ec != std::errc())
        return std::nullopt;
    constexpr float usual = 2.2f, near = 0.1f;  // that programs write for sRGB
    if (std::abs(gamma - usual) < near) return ImageEncoding{Kind::srgb, 1};
    return gamma > 0 && gamma < 10 ? std::optional(ImageEncoding{Kind::gamma, gamma}) : std::nullopt;
}

StoredTexels stored_texels_of(const OIIO::ImageSpec& spec, const ImageEncoding& encoding) {
    StoredTexels stored;
    stored.width = static_cast<uint32_t>(spec.width);
    stored.height = static_cast<uint32_t>(spec.height);
    stored.channels = static_cast<uint32_t>(std::min(spec.nchannels, 4));
    stored.kind = kind_of(spec);
    const bool integers = stored.kind == StoredKind::unsigned_8 || stored.kind == StoredKind::unsigned_16;
    stored.encoding = encoding;
    if (encoding.kind == ImageEncoding::Kind::automatic)
        stored.encoding = encoding_of(spec).value_or(ImageEncoding{integers ? ImageEncoding::Kind::srgb : ImageEncoding::Kind::linear, 1});
    return stored;
}

class LibraryRows final : public ImageRows {
public:
    // proxy: of an image in memory; else null.
    LibraryRows(std::unique_ptr<OIIO::ImageInput> input, std::unique_ptr<OIIO::Filesystem::IOProxy> proxy, std::filesystem::path path,
                const ImageEncoding& encoding)
        : proxy_(std::move(proxy)),
          input_(std::move(input)),
          path_(std::move(path)),
          stored_(stored_texels_of(input_->spec(), encoding)),
          conversion_(path_.string(), stored_) {}
    const ImageShape& shape() const override { return conversion_.shape(); }

    Status read(const std::function<Status(std::span<const std::byte>)>& take) override try {
        const OIIO::ImageSpec spec = input_->spec();
        const bool tiled = spec.tile_width > 0;
        const uint64_t row = uint64_t{stored_.width} * stored_.channels * bytes_of_stored(stored_.kind);
        const uint64_t step = tiled ? static_cast<uint64_t>(std::max(spec.tile_height, 1)) : std::max<uint64_t>(1, bytes_at_once / row);
        if (row * std::min<uint64_t>(step, stored_.height) > most_bytes_at_once)
            return Status::failed(fmt::format("{}: its tiles of {} rows are too large to be read; the file is damaged, or convert it to scan lines",
                                              path_.string(), spec.tile_height));
        std::vector<std::byte> rows;
        for (uint64_t y = 0; y < stored_.height; y += step) {
            const uint64_t count = std::min<uint64_t>(step, stored_.height - y);
            rows.resize(count * row);
            if (!read_rows(spec, static_cast<int>(y), static_cast<int>(count), rows.data()))
                return Status::failed(fmt::format("{}: cannot be read: {}", path_.string(), one_line(input_->geterror())));
            RAYPAGER_TRY(take(conversion_.convert(rows)));
        }
        conversion_.warn();
        return {};
    } catch (const std::exception& error) {
        return Status::failed(fmt::format("{}: cannot be read: {}", path_.string(), one_line(error.what())));
    }

private:
    bool read_rows(const OIIO::ImageSpec& spec, int y, int count, std::byte* rows) {
        // These say what is wrong to the library alone, and take most of the time: others can be heard meanwhile.
        const std::string_view format = input_->format_name();
        std::optional<SilentStderr> silent;
        if (format != "openexr" && format != "jpeg" && format != "tiff") silent.emplace();
        const int top = spec.y + y, channels = static_cast<int>(stored_.channels);
        const OIIO::TypeDesc type = type_of(stored_.kind);
        return spec.tile_width > 0 ? input_->read_tiles(0, 0, spec.x, spec.x + spec.width, top, top + count, 0, 1, 0, channels, type, rows)
                                   : input_->read_scanlines(0, 0, top, top + count, 0, 0, channels, type, rows);
    }

    const std::unique_ptr<OIIO::Filesystem::IOProxy> proxy_;
    const std::unique_ptr<OIIO::ImageInput> input_;
    const std::filesystem::path path_;
    const StoredTexels stored_;
    TexelConversion conversion_;
};

// Colours are wanted as they are in the file, not multiplied by alpha.
OIIO::ImageSpec plain_colors() {
    OIIO::ImageSpec config;
    config.attribute("oiio:UnassociatedAlpha", 1);
    return config;
}

Status check_texture(const OIIO::ImageInput& input, const std::filesystem::path& path, uint64_t bytes) {
    const OIIO::ImageSpec& spec = input.spec();
    if (spec.width < 0 || spec.height < 0 || spec.nchannels < 1 || spec.depth > 1 || spec.deep)
        return Status::failed(fmt::format("{}: is not a flat image ({} x {} x {} texels, {} channels)", path.string(), spec.width, spec.height,
                                          spec.depth, spec.nchannels));
    RAYPAGER_TRY(check_texture_size(path, static_cast<uint64_t>(spec.width), static_cast<uint64_t>(spec.height)));
    if (claims_too_much(spec, input.format_name(), bytes))
        return Status::failed(fmt::format("{}: claims {} x {} texels, more than its {} bytes can hold; it is damaged or cut off", path.string(),
                                          spec.width, spec.height, bytes));
    return {};
}

}  // namespace

Result<std::unique_ptr<ImageRows>> open_rows_with_openimageio(const std::filesystem::path& path, const ImageEncoding& encoding) try {
    auto input = open_image_input(path, plain_colors());
    if (!input) return input.status();
    RAYPAGER_TRY(check_texture(**input, path, std::filesystem::file_size(path)));
    return std::unique_ptr<ImageRows>(std::make_unique<LibraryRows>(std::move(*input), nullptr, path, encoding));
} catch (const std::exception& error) {
    return Status::failed(fmt::format("{}: cannot be read: {}", path.string(), one_line(error.what())));
}

Result<std::unique_ptr<ImageRows>> open_embedded_rows_with_openimageio(const EmbeddedPicture& picture, const ImageEncoding& encoding) try {
    auto proxy = std::make_unique<OIIO::Filesystem::IOMemReader>(const_cast<std::byte*>(picture.bytes.data()), picture.bytes.size());
    auto input = open_image_input(picture, *proxy, plain_colors());
    if (!input) return input.status();
    RAYPAGER_TRY(check_texture(**input, picture.name, picture.bytes.size()));
    return std::unique_ptr<ImageRows>(std::make_unique<LibraryRows>(std::move(*input), std::move(proxy), picture.name, encoding));
} catch (const std::exception& error) {
    return Status::failed(fmt::format("{}: cannot be read: {}", picture.name, one_line(error.what())));
}

}  // namespace raypager
