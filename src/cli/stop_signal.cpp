#include "cli/stop_signal.hpp"

#include <csignal>

namespace raypager {
namespace {

std::atomic<bool> stop{false};
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler must not lock");

void restore_defaults() {
    std::signal(SIGINT, SIG_DFL);
    std::signal(SIGTERM, SIG_DFL);
}

void on_signal(int) {
    stop = true;
    restore_defaults();
}

}  // namespace

StopSignal::StopSignal() {
    stop = false;
    struct sigaction action = {};
    action.sa_handler = on_signal;
    action.sa_flags = SA_RESTART;  // reads and writes under way go on
    sigaction(SIGINT, &action, nullptr);
    sigaction(SIGTERM, &action, nullptr);
}

StopSignal::~StopSignal() { restore_defaults(); }

const std::atomic<bool>& StopSignal::flag() const { return stop; }

}  // namespace raypager
