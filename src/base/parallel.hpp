// Work on all cores.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>

#include "raypager/status.hpp"

namespace raypager {

size_t worker_count();  // at least 1
// Calls work(begin, end) for pieces of [0, count) of at most `piece` items, on all cores; returns when all are done. Within such work there
// is no more to be spread: an inner call does all of it itself. An exception of one of them ends the work, and is thrown again here.
// most: threads at work at once.
void parallel_for(size_t count, size_t piece, const std::function<void(size_t begin, size_t end)>& work, size_t most = SIZE_MAX);
// The same for work that can fail: then the rest is left, and one of the failures returned.
Status parallel_try(size_t count, size_t piece, const std::function<Status(size_t begin, size_t end)>& work, size_t most = SIZE_MAX);

// While one of these is alive, so many threads at most work for a call by its thread, itself included: the others are busy.
class WorkersAtMost {
public:
    explicit WorkersAtMost(size_t threads);  // REQUIRES: threads >= 1
    ~WorkersAtMost();
    WorkersAtMost(const WorkersAtMost&) = delete;
    WorkersAtMost& operator=(const WorkersAtMost&) = delete;

private:
    size_t before_;
};
// How many threads would work for a call by this one, at least 1.
size_t helping_workers();

}  // namespace raypager
