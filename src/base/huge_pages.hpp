// Large pages for large arrays: first use of much memory is mostly the system's work, a page of 4 KiB at a time.
#pragma once

#include <algorithm>
#include <cstddef>
#include <memory>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

namespace raypager {

// Asks the system to make memory that nobody has used yet of large pages. A wish, no more.
void ask_for_huge_pages(std::span<std::byte> memory);

// Below this a vector is left as it is. With 8 MB instead, baking 10 to 15 M triangles takes 7 to 15 % longer.
inline constexpr size_t min_in_huge_pages = size_t{2} << 20;

// Like reserve(), in large pages; what is there moves into them.
template <class T>
void reserve_huge(std::vector<T>& vector, size_t count) {
    if (count <= vector.capacity()) return;
    if (count * sizeof(T) < min_in_huge_pages) return vector.reserve(count);
    std::vector<T> larger;
    larger.reserve(count);
    ask_for_huge_pages({reinterpret_cast<std::byte*>(larger.data()), larger.capacity() * sizeof(T)});
    larger.insert(larger.end(), vector.begin(), vector.end());
    vector.swap(larger);
}

template <class T>
void resize_huge(std::vector<T>& vector, size_t count) {
    reserve_huge(vector, count);
    vector.resize(count);
}

// The same for a vector that grows step by step, to about `expected` in the end, if that is known.
template <class Vector>
void grow_huge(Vector& vector, size_t count, size_t expected = 0) {
    if (count <= vector.capacity()) return;
    const size_t capacity = std::max({count, expected, 2 * vector.capacity()});
    if constexpr (std::is_same_v<Vector, std::vector<typename Vector::value_type>>)
        reserve_huge(vector, capacity);
    else
        vector.reserve(capacity);
}

// Memory in large pages whose contents are left as they come: resize() does not write what is to be overwritten anyway, by all cores.
// For types that are copied byte by byte.
template <class T>
struct UnwrittenAllocator {
    static_assert(std::is_trivially_copyable_v<T>);
    using value_type = T;
    UnwrittenAllocator() = default;
    template <class U>
    UnwrittenAllocator(const UnwrittenAllocator<U>&) {}
    T* allocate(size_t count) {
        T* const memory = std::allocator<T>().allocate(count);
        if (count * sizeof(T) >= min_in_huge_pages) ask_for_huge_pages(std::as_writable_bytes(std::span(memory, count)));
        return memory;
    }
    void deallocate(T* memory, size_t count) { std::allocator<T>().deallocate(memory, count); }
    template <class U>
    void construct(U*) {}
    template <class U, class... From>
    void construct(U* place, From&&... from) {
        std::construct_at(place, std::forward<From>(from)...);
    }
    bool operator==(const UnwrittenAllocator&) const { return true; }
};
template <class T>
using UnwrittenVector = std::vector<T, UnwrittenAllocator<T>>;

}  // namespace raypager
