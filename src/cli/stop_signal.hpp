// Ctrl-C while baking or rendering: the first one asks for a clean end, of a render with a picture; the second one kills.
#pragma once

#include <atomic>

namespace raypager {

// Catches SIGINT and SIGTERM as long as it lives. One at a time.
class StopSignal {
public:
    StopSignal();
    ~StopSignal();
    StopSignal(const StopSignal&) = delete;
    StopSignal& operator=(const StopSignal&) = delete;
    const std::atomic<bool>& flag() const;
};

}  // namespace raypager
