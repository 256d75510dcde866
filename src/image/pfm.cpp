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

namespace raypager {
namespace {

static_assert(std::endian::native == std::endian::little, "write_pfm stores floats as they lie in memory");

constexpr size_t max_header_bytes = 128;

struct PfmHeader {
    uint32_t channels = 0;
    uint64_t width = 0, height = 0;
    float scale = 1;
    bool big_endian = false;
    size_t bytes = 0;  // of the header: the values follow
};

bool is_space(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }

// The next word of text from at on; at moves to the white space behind it. Empty if there is none that ends within text.
std::string_view next_word(std::string_view text, size_t& at) {
    while (at < text.size() && is_space(text[at])) at++;
    const size_t begin = at;
    while (at < text.size() && !is_space(text[at])) at++;
    return at < text.size() ? text.substr(begin, at - begin) : std::string_view{};
}

template <class Number>
bool parse(std::string_view word, Number& number) {
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
    return error == std::errc{} && end == word.data() + word.size();
}

std::optional<PfmHeader> parse_header(std::string_view text) {
    PfmHeader header;
    size_t at = 0;
    const std::string_view kind = next_word(text, at);
    if (at != 2 || (kind != "PF" && kind != "Pf")) return std::nullopt;
    header.channels = kind == "PF" ? 3 : 1;
    if (!parse(next_word(text, at), header.width) || !parse(next_word(text, at), header.height)) return std::nullopt;
    if (!parse(next_word(text, at), header.scale) || !std::isfinite(header.scale) || header.scale == 0) return std::nullopt;
    header.big_endian = header.scale > 0;
    header.scale = std::abs(header.scale);
    header.bytes = at + 1;  // exactly one white space ends the header
    return header;
}

void swap_bytes(std::span<float> values) {
    for (float& value : values) value = std::bit_cast<float>(__builtin_bswap32(std::bit_cast<uint32_t>(value)));
}

// The file has its last row first.
void flip_rows(Image& image) {
    const size_t row = size_t{image.width} * image.channels;
    for (size_t y = 0; y < image.height / 2; y++)
        std::swap_ranges(image.values.begin() + static_cast<ptrdiff_t>(y * row), image.values.begin() + static_cast<ptrdiff_t>((y + 1) * row),
                         image.values.begin() + static_cast<ptrdiff_t>((image.height - 1 - y) * row));
}

}  // namespace

Result<Image> read_pfm(const std::filesystem::path& path, bool raw) {
    auto file = InputFile::open(path);
    if (!file) return file.status();
    std::string text(std::min<uint64_t>(file->size(), max_header_bytes), '\0');
    RAYPAGER_TRY(file->read(0, std::as_writable_bytes(std::span(text))));
    const std::optional<PfmHeader> header = parse_header(text);
    if (!header) return Status::failed(fmt::format("{}: is not a PFM picture: it must begin with PF or Pf, width, height and scale", path.string()));
    RAYPAGER_TRY(check_image_size(path, header->width, header->height));

    const uint64_t count = header->width * header->height * header->channels;
    const uint64_t expected = header->bytes + count * sizeof(float);
    if (file->size() != expected)
        return Status::failed(fmt::format("{}: has {} bytes, but a PFM picture of {} x {} pixels has {}; the file is damaged", path.string(),
                                          file->size(), header->width, header->height, expected));
    Image image{static_cast<uint32_t>(header->width), static_cast<uint32_t>(header->height), header->channels, std::vector<float>(count)};
    RAYPAGER_TRY(file->read(header->bytes, std::as_writable_bytes(std::span(image.values))));
    if (header->big_endian) swap_bytes(image.values);
    flip_rows(image);
    if (!raw && header->scale != 1)
        for (float& value : image.values) value *= header->scale;
    return image;
}

Status write_pfm(const std::filesystem::path& path, const Image& image) {
    auto file = OutputFile::create(path);
    if (!file) return file.status();
    RAYPAGER_TRY(file->write(fmt::format("{}\n{} {}\n-1.0\n", image.channels == 3 ? "PF" : "Pf", image.width, image.height)));
    const size_t row = size_t{image.width} * image.channels;
    for (uint32_t y = image.height; y-- > 0;) RAYPAGER_TRY(file->write(std::as_bytes(std::span(image.values).subspan(y * row, row))));
    return file->commit();
}

}  // namespace raypager
