// Items made by all threads, of which some may be left out: those that are kept, in order.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "base/huge_pages.hpp"
#include "base/parallel.hpp"

namespace raypager {

// Appends up to `count` items. fill(begin, end, place) makes those of [begin, end), at most `piece` of them, from place on, and returns how many it
// has made.
template <class T, class Fill>
void append_kept(UnwrittenVector<T>& items, size_t count, size_t piece, const Fill& fill) {
    const size_t base = items.size();
    grow_huge(items, base + count);
    items.resize(base + count);
    std::vector<size_t> kept((count + piece - 1) / piece);
    parallel_for(count, piece, [&](size_t begin, size_t end) { kept[begin / piece] = fill(begin, end, items.data() + base + begin); });
    size_t place = base;
    for (size_t i = 0; i < kept.size(); i++) {
        const auto from = items.begin() + static_cast<ptrdiff_t>(base + i * piece);
        if (place != base + i * piece) std::copy(from, from + static_cast<ptrdiff_t>(kept[i]), items.begin() + static_cast<ptrdiff_t>(place));
        place += kept[i];
    }
    items.resize(place);
}

}  // namespace raypager
