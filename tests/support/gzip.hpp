// Packs as gzip does (RFC 1952), but without compressing: its stored blocks need no library.
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>
#include <string_view>

namespace raypager::support {

inline std::string gzip_of(std::string_view content) {
    const auto little_endian = [](uint32_t value, size_t bytes) {
        std::string text;
        for (size_t i = 0; i < bytes; ++i) text += static_cast<char>(value >> 8 * i & 255);
        return text;
    };
    uint32_t crc = 0xffffffffu;
    for (const char c : content) {
        crc ^= static_cast<uint8_t>(c);
        for (int bit = 0; bit < 8; ++bit) crc = crc >> 1 ^ (crc & 1 ? 0xedb88320u : 0);
    }
    std::string packed("\x1f\x8b\x08\0\0\0\0\0\0\xff", 10);
    for (size_t at = 0; at == 0 || at < content.size(); at += 0xffff) {
        const std::string_view block = content.substr(at, 0xffff);
        const auto length = static_cast<uint32_t>(block.size());
        packed += at + block.size() >= content.size() ? '\1' : '\0';
        packed += little_endian(length, 2) + little_endian(~length, 2);
        packed += block;
    }
    return packed + little_endian(~crc, 4) + little_endian(static_cast<uint32_t>(content.size()), 4);
}

}  // namespace raypager::support
