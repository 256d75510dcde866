// Checksums and fingerprints: XXH3, 64 bit (not cryptographic).
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>

namespace raypager {

uint64_t hash64(std::span<const std::byte> bytes, uint64_t seed = 0);
uint64_t hash64(std::string_view text, uint64_t seed = 0);
std::string hex64(uint64_t value);  // 16 digits

// hash64 of bytes that come piece by piece; how they are cut makes no difference.
class Hash64Stream {
public:
    explicit Hash64Stream(uint64_t seed = 0);
    Hash64Stream(Hash64Stream&&) noexcept;
    Hash64Stream& operator=(Hash64Stream&&) noexcept;
    ~Hash64Stream();
    void add(std::span<const std::byte> bytes);
    uint64_t value() const;  // of all that has come so far

private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace raypager
