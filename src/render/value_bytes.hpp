// Plain values as bytes, for the other processes of a render.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <type_traits>
#include <vector>

namespace raypager {

// Appends how many there are, and then these.
template <class T>
void put_values(std::vector<std::byte>& bytes, const std::vector<T>& values) {
    static_assert(std::is_trivially_copyable_v<T>);
    const uint64_t count = values.size();
    const auto append = [&](std::span<const std::byte> more) { bytes.insert(bytes.end(), more.begin(), more.end()); };
    append(std::as_bytes(std::span(&count, 1)));
    append(std::as_bytes(std::span(values)));
}

// Takes them away from the beginning. REQUIRES: another process of the same
// program has put them there.
template <class T>
std::vector<T> take_values(std::span<const std::byte>& bytes) {
    static_assert(std::is_trivially_copyable_v<T>);
    uint64_t count = 0;
    std::memcpy(&count, bytes.data(), sizeof count);
    bytes = bytes.subspan(sizeof count);
    std::vector<T> values(count);
    std::memcpy(values.data(), bytes.data(), count * sizeof(T));
    bytes = bytes.subspan(count * sizeof(T));
    return values;
}

}  // namespace raypager
