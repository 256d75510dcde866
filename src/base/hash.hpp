// Checksums and fingerprints: XXH3, 64 bit (not cryptographic).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace raypager {

uint64_t hash64(std::span<const std::byte> bytes, uint64_t seed = 0);
uint64_t hash64(std::string_view text, uint64_t seed = 0);
std::string hex64(uint64_t value);  // 16 digits

}  // namespace raypager
