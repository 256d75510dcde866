#include <gtest/gtest.h>

#include <csignal>

#include "cli/stop_signal.hpp"

namespace raypager {
namespace {

bool is_default(int number) {
    struct sigaction action = {};
    sigaction(number, nullptr, &action);
    return action.sa_handler == SIG_DFL;
}

TEST(StopSignal, leaves_no_trace_where_nobody_stopped) {
    { const StopSignal signal(StopMode::keep); }
    EXPECT_TRUE(is_default(SIGINT));
    EXPECT_TRUE(is_default(SIGTERM));
}

// With sanitizers the program took so long to exit that the second of two signals killed it, with its picture written.
TEST(StopSignal, a_second_signal_spares_a_program_that_has_stopped) {
    {
        const StopSignal signal(StopMode::keep);
        raise(SIGINT);
        EXPECT_TRUE(signal.stop());
        EXPECT_FALSE(signal.stop_now());
    }
    raise(SIGINT);
    EXPECT_TRUE(is_default(SIGINT)) << "the next one kills";
}

TEST(StopSignal, begins_anew) {
    {
        const StopSignal signal(StopMode::finish);
        raise(SIGTERM);
        EXPECT_TRUE(signal.stop());
    }
    const StopSignal signal(StopMode::keep);
    EXPECT_FALSE(signal.stop());
    raise(SIGINT);
    EXPECT_TRUE(signal.stop());
    raise(SIGINT);
    EXPECT_TRUE(signal.stop_now());
}

}  // namespace
}  // namespace raypager
