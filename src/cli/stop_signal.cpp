#include "cli/stop_signal.hpp"

#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>

#include "base/log.hpp"
#include "raypager/status.hpp"

namespace raypager {
namespace {

std::atomic<bool> stop_flag{false}, stop_now_flag{false}, on_terminal{false}, leaves_quietly{false};
std::atomic<int> mode{0}, alive{0};
static_assert(std::atomic<bool>::is_always_lock_free && std::atomic<int>::is_always_lock_free, "a signal handler must not lock");

void restore_defaults() {
    std::signal(SIGINT, SIG_DFL);
    std::signal(SIGTERM, SIG_DFL);
}

// Signal handlers may call little more than write().
void say(const char* text) {
    const auto put = [](const char* part) {
        if (::write(STDERR_FILENO, part, std::strlen(part)) < 0) return;  // nobody is left to be told
    };
    if (on_terminal) put("\r\033[K");  // over a line of progress, and the ^C that the terminal shows
    put(text);
}

void on_signal(int) {
    const int error = errno;
    if (alive == 0) {  // stopped already, and about to exit
        restore_defaults();
        return;
    }
    const auto now = static_cast<StopMode>(mode.load());
    if (now == StopMode::leave) {
        if (!leaves_quietly) say("raypager: stopped by a signal before there was anything to keep\n");
        _exit(static_cast<int>(ErrorKind::interrupted));
    }
    if (!stop_flag.exchange(true)) {
        say(now == StopMode::keep ? "raypager: stopping, in two seconds at most; Ctrl-C again stops now, with the picture as it is\n"
                                  : "raypager: stopping; Ctrl-C again kills the program\n");
        if (now == StopMode::finish) restore_defaults();
    } else if (!stop_now_flag.exchange(true)) {
        say("raypager: stopping now; Ctrl-C again kills the program, without a picture\n");
        restore_defaults();
    }
    errno = error;
}

void catch_signals() {
    struct sigaction action = {};
    action.sa_handler = on_signal;
    action.sa_flags = SA_RESTART;  // reads and writes under way go on
    sigaction(SIGINT, &action, nullptr);
    sigaction(SIGTERM, &action, nullptr);
}

}  // namespace

StopSignal::StopSignal(StopMode first) : before_(static_cast<StopMode>(mode.load())) {
    on_terminal = stderr_is_terminal();
    mode = static_cast<int>(first);
    if (alive++ > 0) return;
    stop_flag = stop_now_flag = false;
    catch_signals();
}

StopSignal::~StopSignal() {
    mode = static_cast<int>(before_);
    // Whoever presses Ctrl-C twice must not take the exit status from a program that has written all and is on its way out.
    if (--alive == 0 && !stop_flag) restore_defaults();
}

void StopSignal::set_mode(StopMode now) const { mode = static_cast<int>(now); }
void StopSignal::leave_quietly() { leaves_quietly = true; }
const std::atomic<bool>& StopSignal::stop() const { return stop_flag; }
const std::atomic<bool>& StopSignal::stop_now() const { return stop_now_flag; }

}  // namespace raypager
