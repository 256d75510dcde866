#include "image/claimed_sizes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace raypager {
namespace {

constexpr std::string_view png_magic = "\x89PNG\r\n\x1a\n";
constexpr std::string_view exr_magic = "\x76\x2f\x31\x01";
constexpr uint64_t first_attribute_at = 8;  // magic, version and flags
constexpr uint32_t several_parts_flag = 0x1000;
constexpr size_t longest_name = 255;

// Little-endian.
uint32_t number(std::span<const std::byte, 4> bytes) {
    uint32_t value = 0;
    for (size_t i = 4; i > 0; i--) value = value << 8 | std::to_integer<uint32_t>(bytes[i - 1]);
    return value;
}

Status claims_more(const SizedBytes& file, const char* part, uint64_t at, uint64_t bytes) {
    return Status::failed(fmt::format("{}: {} claims {} bytes at offset {}, where the file has {}; it is damaged or cut off", file.name, part, bytes,
                                      at, file.size - at));
}

struct Name {
    std::string text;
    uint64_t end;  // the place behind it
};
// The name at `at`, or nothing if none ends there.
Result<std::optional<Name>> read_name(const SizedBytes& file, uint64_t at) {
    std::array<std::byte, longest_name + 1> bytes;
    const auto part = std::span(bytes).first(static_cast<size_t>(std::min<uint64_t>(bytes.size(), file.size - std::min(at, file.size))));
    RAYPAGER_TRY(file.read(at, part));
    const auto end = std::ranges::find(part, std::byte{0});
    if (end == part.end()) return std::optional<Name>();
    const auto length = static_cast<size_t>(end - part.begin());
    return std::optional(Name{std::string(reinterpret_cast<const char*>(part.data()), length), at + length + 1});
}

}  // namespace

SizedBytes bytes_of_file(const InputFile& file) {
    return {file.path().string(), file.size(), [&file](uint64_t offset, std::span<std::byte> bytes) { return file.read(offset, bytes); }};
}

SizedBytes bytes_in_memory(const std::string& name, std::span<const std::byte> bytes) {
    return {name, bytes.size(), [name, bytes](uint64_t offset, std::span<std::byte> out) {
                if (offset > bytes.size() || out.size() > bytes.size() - offset) return Status::failed(name + ": is cut off");
                std::copy_n(bytes.begin() + static_cast<ptrdiff_t>(offset), out.size(), out.begin());
                return Status();
            }};
}

Status check_exr_attributes(const SizedBytes& file) {
    std::array<std::byte, 4> four;
    if (file.size < first_attribute_at) return {};
    RAYPAGER_TRY(file.read(0, four));
    if (std::memcmp(four.data(), exr_magic.data(), four.size()) != 0) return {};
    RAYPAGER_TRY(file.read(four.size(), four));
    const bool several_parts = (number(four) & several_parts_flag) != 0;
    bool header_ended = false;
    for (uint64_t at = first_attribute_at;;) {
        const auto name = read_name(file, at);
        if (!name) return name.status();
        if (!*name) return {};
        // An empty name ends a header; in a file of several parts the next header follows, and an empty one ends them.
        const bool ends = (*name)->text.empty();
        if (ends && (header_ended || !several_parts)) return {};
        header_ended = ends;
        at = (*name)->end;
        if (ends) continue;
        const auto type = read_name(file, at);
        if (!type) return type.status();
        if (!*type || file.size - (*type)->end < four.size()) return {};
        RAYPAGER_TRY(file.read((*type)->end, four));
        const uint64_t bytes = number(four), value_at = (*type)->end + four.size();
        if (bytes > file.size - value_at) return claims_more(file, "an attribute of the header", value_at, bytes);
        at = value_at + bytes;
    }
}

Status check_png_chunks(const SizedBytes& file) {
    // Big-endian length and type, the contents, a checksum.
    constexpr uint64_t before = 8, after = 4;
    std::array<std::byte, before> head;
    if (file.size < head.size()) return {};
    RAYPAGER_TRY(file.read(0, head));
    if (std::memcmp(head.data(), png_magic.data(), head.size()) != 0) return {};
    for (uint64_t at = head.size(); at + before <= file.size;) {
        RAYPAGER_TRY(file.read(at, head));
        std::reverse(head.begin(), head.begin() + 4);
        const uint64_t bytes = number(std::span(head).first<4>()), contents_at = at + before;
        if (bytes > file.size - contents_at) return claims_more(file, "a chunk", contents_at, bytes);
        if (std::memcmp(head.data() + 4, "IEND", 4) == 0) return {};
        at = contents_at + bytes + after;
    }
    return {};
}

}  // namespace raypager
