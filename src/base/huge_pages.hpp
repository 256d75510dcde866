// Large pages for large arrays: first use of much memory is mostly the system's work, a page of 4 KiB at a time.
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

namespace raypager {

// Asks the system to make memory that nobody has used yet of large pages. A wish, no more.
void ask_for_huge_pages(std::span<std::byte> memory);

// Like reserve(), in large pages.
template <class T>
void reserve_huge(std::vector<T>& vector, size_t count) {
    if (count <= vector.capacity()) return;
    vector.reserve(count);
    auto* const begin = reinterpret_cast<std::byte*>(vector.data());
    ask_for_huge_pages({begin + vector.size() * sizeof(T), begin + vector.capacity() * sizeof(T)});
}

// The same for a vector that grows step by step.
template <class T>
void grow_huge(std::vector<T>& vector, size_t count) {
    if (count > vector.capacity()) reserve_huge(vector, std::max(count, 2 * vector.capacity()));
}

}  // namespace raypager
