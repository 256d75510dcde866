// Work on all cores.
#pragma once

#include <cstddef>
#include <functional>

namespace raypager {

size_t worker_count();  // at least 1
// Calls work(begin, end) for pieces of [0, count) of at most `piece` items, on all cores; returns when all are done. An
// exception of one of them ends the work, and is thrown again here.
void parallel_for(size_t count, size_t piece, const std::function<void(size_t begin, size_t end)>& work);

}  // namespace raypager
