// Ctrl-C (SIGINT) and SIGTERM: each is answered at once by a line on stderr that says what happens now, and what the next one would do.
#pragma once

#include <atomic>

namespace raypager {

// What a signal means at the moment.
enum class StopMode {
    leave,   // the program ends with exit status 3: there is nothing to keep yet
    finish,  // stop() is set, for a clean end; the next signal kills
    keep,    // the same, but the next one sets stop_now(), and only the third kills
};

// Catches signals as long as it lives; afterwards they do what they did before, but for the first one after a stop, which is ignored.
// Several may live at a time: the last one decides.
class StopSignal {
public:
    explicit StopSignal(StopMode mode);
    ~StopSignal();
    StopSignal(const StopSignal&) = delete;
    StopSignal& operator=(const StopSignal&) = delete;
    void set_mode(StopMode mode) const;
    // For processes that a launcher ends with each other: it says so, and they do not.
    static void leave_quietly();
    const std::atomic<bool>& stop() const;
    const std::atomic<bool>& stop_now() const;

private:
    StopMode before_;
};

}  // namespace raypager
