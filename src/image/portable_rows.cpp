// Portable maps, row by row. Formats: "pgm", "ppm" and "pfm", netpbm.sourceforge.net and pauldebevec.com.
#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <optional>
#include <string_view>

#include "base/files.hpp"
#include "image/formats.hpp"
#include "image/texel_conversion.hpp"

namespace raypager {
namespace {

constexpr uint64_t longest_portable_header = 4096;  // comments included
constexpr uint64_t portable_bytes_at_once = uint64_t{1} << 20;

struct PortableHeader {
    uint32_t channels = 0;
    uint64_t width = 0, height = 0;
    double largest = 0;  // of integers; of floats the scale
    bool floats = false;
    uint64_t bytes = 0;  // of the header: the values follow
    uint64_t value_bytes() const { return floats ? 4 : largest > 255 ? 2 : 1; }
    uint64_t row_bytes() const { return width * channels * value_bytes(); }
};

// Words between white space and comments.
class PortableWords {
public:
    explicit PortableWords(std::string_view text) : text_(text) {}
    // Empty if there is none that ends within the text.
    std::string_view next() {
        while (at_ < text_.size() && (is_white(text_[at_]) || text_[at_] == '#'))
            at_ = text_[at_] == '#' ? std::min(text_.find('\n', at_), text_.size()) : at_ + 1;
        const size_t begin = at_;
        while (at_ < text_.size() && !is_white(text_[at_])) at_++;
        return at_ < text_.size() ? text_.substr(begin, at_ - begin) : std::string_view();
    }
    template <class Number>
    bool next(Number& number) {
        const std::string_view word = next();
        const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
        return !word.empty() && error == std::errc() && end == word.data() + word.size();
    }
    size_t at() const { return at_; }

private:
    static bool is_white(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }
    std::string_view text_;
    size_t at_ = 0;
};

std::optional<PortableHeader> parse_portable_header(std::string_view text) {
    PortableHeader header;
    PortableWords words(text);
    const std::string_view kind = words.next();
    header.channels = kind == "P6" || kind == "PF" ? 3 : 1;
    header.floats = kind == "PF" || kind == "Pf";
    if (!words.next(header.width) || !words.next(header.height) || !words.next(header.largest) || !std::isfinite(header.largest)) return std::nullopt;
    const double largest = header.largest;
    if (header.floats ? largest == 0 || std::abs(largest) > 1e30 : largest < 1 || largest > 65535 || largest != std::floor(largest))
        return std::nullopt;
    header.bytes = words.at() + 1;  // exactly one white space ends the header
    return header;
}

void swap_pairs(std::span<std::byte> bytes) {
    for (size_t i = 0; i + 1 < bytes.size(); i += 2) std::swap(bytes[i], bytes[i + 1]);
}

void swap_fours(std::span<std::byte> bytes) {
    for (size_t i = 0; i + 3 < bytes.size(); i += 4)
        std::reverse(bytes.begin() + static_cast<ptrdiff_t>(i), bytes.begin() + static_cast<ptrdiff_t>(i + 4));
}

StoredTexels stored_texels(const PortableHeader& header, const ImageEncoding& encoding) {
    StoredTexels stored;
    stored.width = static_cast<uint32_t>(header.width);
    stored.height = static_cast<uint32_t>(header.height);
    stored.channels = header.channels;
    stored.encoding = encoding;
    if (encoding.kind == ImageEncoding::Kind::automatic)
        stored.encoding.kind = header.floats ? ImageEncoding::Kind::linear : ImageEncoding::Kind::srgb;
    if (header.floats) {
        stored.kind = StoredKind::float_32;
        stored.scale = static_cast<float>(std::abs(header.largest));
    } else {
        stored.kind = header.largest > 255 ? StoredKind::unsigned_16 : StoredKind::unsigned_8;
        stored.largest = static_cast<uint32_t>(header.largest);
    }
    return stored;
}

class PortableRows final : public ImageRows {
public:
    PortableRows(InputFile file, const PortableHeader& header, const ImageEncoding& encoding)
        : file_(std::move(file)), header_(header), conversion_(file_.path().string(), stored_texels(header, encoding)) {}
    const ImageShape& shape() const override { return conversion_.shape(); }

    Status read(const std::function<Status(std::span<const std::byte>)>& take) override {
        const uint64_t row = header_.row_bytes();
        // Float maps have their last row first.
        const uint64_t at_once = header_.floats ? 1 : std::max<uint64_t>(1, portable_bytes_at_once / row);
        std::vector<std::byte> rows;
        for (uint64_t y = 0; y < header_.height; y += at_once) {
            rows.resize(std::min(at_once, header_.height - y) * row);
            RAYPAGER_TRY(file_.read(header_.bytes + (header_.floats ? header_.height - 1 - y : y) * row, rows));
            if (header_.floats && header_.largest > 0) swap_fours(rows);
            if (header_.value_bytes() == 2) swap_pairs(rows);
            RAYPAGER_TRY(take(conversion_.convert(rows)));
        }
        conversion_.warn();
        return {};
    }

private:
    const InputFile file_;
    const PortableHeader header_;
    TexelConversion conversion_;
};

}  // namespace

Result<std::unique_ptr<ImageRows>> open_portable_rows(const std::filesystem::path& path, const ImageEncoding& encoding) {
    auto file = InputFile::open(path);
    if (!file) return file.status();
    std::string text(std::min(file->size(), longest_portable_header), '\0');
    RAYPAGER_TRY(file->read(0, std::as_writable_bytes(std::span(text))));
    const std::string_view kind = std::string_view(text).substr(0, 2);
    if (kind != "P5" && kind != "P6" && kind != "PF" && kind != "Pf") return std::unique_ptr<ImageRows>();
    const auto header = parse_portable_header(text);
    if (!header)
        return Status::failed(
            fmt::format("{}: begins with {}, but width, height and the largest value that must follow make no sense", path.string(), kind));
    RAYPAGER_TRY(check_texture_size(path, header->width, header->height));
    const uint64_t expected = header->bytes + header->height * header->row_bytes();
    if (file->size() < expected)
        return Status::failed(fmt::format("{}: has {} bytes, but an image of {} x {} texels takes {}; it is cut off", path.string(), file->size(),
                                          header->width, header->height, expected));
    return std::unique_ptr<ImageRows>(std::make_unique<PortableRows>(std::move(*file), *header, encoding));
}

}  // namespace raypager
