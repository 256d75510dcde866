#include "import/stl_layout.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "import/text.hpp"

namespace raypager {
namespace {

char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; }

// Begins with "solid", and there is nothing in it but text.
bool looks_like_text(std::string start) {
    if (start.starts_with("\xef\xbb\xbf")) start.erase(0, 3);
    std::transform(start.begin(), start.end(), start.begin(), lower);
    const auto words = split_words(start);
    if (words.empty() || !words[0].starts_with("solid")) return false;
    const auto odd = std::count_if(start.begin(), start.end(), [](char c) { return (c >= 0 && c < ' ' && !is_blank(c)) || c == 127; });
    return odd == 0;
}

// Whether the first triangles, if that is what they are, have coordinates as things have them. Other data would give many that are vast or tiny.
Result<bool> could_be_triangles(const InputFile& file, uint64_t most) {
    std::vector<std::byte> bytes(std::min<uint64_t>(most, 64) * stl_triangle_bytes);
    RAYPAGER_TRY(file.read(stl_header_bytes, bytes));
    const auto is_text = [](std::byte b) { return (b >= std::byte{' '} && b <= std::byte{'~'}) || is_blank(static_cast<char>(b)); };
    if (std::all_of(bytes.begin(), bytes.end(), is_text)) return false;
    size_t odd = 0, all = 0;
    for (size_t at = 0; at < bytes.size(); at += stl_triangle_bytes) {
        std::array<float, 9> p;
        std::memcpy(p.data(), bytes.data() + at + 12, sizeof p);
        for (const float x : p) {
            ++all;
            odd += x != 0 && !(std::abs(x) > 1e-18f && std::abs(x) < 1e12f);
        }
    }
    return 10 * odd <= all;
}

}  // namespace

Result<StlLayout> find_stl_layout(const InputFile& file) {
    const std::string name = file.path().string();
    std::string start(std::min<uint64_t>(file.size(), 1024), '\0');
    RAYPAGER_TRY(file.read(0, std::as_writable_bytes(std::span(start))));
    uint32_t count = 0;
    if (start.size() >= stl_header_bytes) std::memcpy(&count, start.data() + 80, 4);
    const uint64_t expected = stl_header_bytes + stl_triangle_bytes * count;
    if (start.size() >= stl_header_bytes && file.size() == expected) {
        if (count == 0) return Status::failed(name + ": has no triangles");
        return StlLayout{true, count, {}};
    }
    if (looks_like_text(start)) return StlLayout{};
    if (start.size() < stl_header_bytes) return Status::failed(fmt::format("{}: {} bytes are too few for an STL file", name, file.size()));
    const uint64_t most = (file.size() - stl_header_bytes) / stl_triangle_bytes;
    const auto plausible = could_be_triangles(file, most);
    if (!plausible) return plausible.status();
    if (most == 0 || !*plausible)
        return Status::failed(
            fmt::format("{}: neither text STL (\"solid\") nor binary STL: its {} triangles would take {} bytes, but the file has {}", name, count,
                        expected, file.size()));
    // A rest that is no whole number of triangles is something that was put behind them.
    const bool tail = count > 0 && count < most && (file.size() - expected) % stl_triangle_bytes != 0;
    const uint64_t triangles = tail || count == most ? count : most;
    return StlLayout{true, triangles,
                     fmt::format("{}: its header says {} triangles, which take {} bytes, but the file has {}; {} are read", name, count, expected,
                                 file.size(), triangles)};
}

}  // namespace raypager
