#include "base/huge_pages.hpp"

#include <sys/mman.h>

#include <memory>

namespace raypager {

void ask_for_huge_pages(std::span<std::byte> memory) {
    constexpr size_t huge_page = size_t{2} << 20;
    void* begin = memory.data();
    size_t bytes = memory.size();
    if (std::align(huge_page, huge_page, begin, bytes)) (void)::madvise(begin, bytes / huge_page * huge_page, MADV_HUGEPAGE);
}

}  // namespace raypager
