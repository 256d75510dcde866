#include "base/huge_pages.hpp"

#include <sys/mman.h>

#include <cstdint>

namespace raypager {

void ask_for_huge_pages(std::span<std::byte> memory) {
    constexpr uintptr_t huge_page = uintptr_t{2} << 20;
    const auto begin = (reinterpret_cast<uintptr_t>(memory.data()) + huge_page - 1) / huge_page * huge_page;
    const auto end = reinterpret_cast<uintptr_t>(memory.data() + memory.size()) / huge_page * huge_page;
    if (begin < end) (void)::madvise(reinterpret_cast<void*>(begin), end - begin, MADV_HUGEPAGE);
}

}  // namespace raypager
