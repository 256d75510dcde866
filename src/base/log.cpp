#include "base/log.hpp"

#include <unistd.h>

#include <cstdio>
#include <mutex>

#include "base/words.hpp"

namespace raypager {
namespace {

std::mutex mutex;
bool line_open = false;

void print(const char* prefix, std::string_view message) {
    const std::lock_guard lock(mutex);
    if (line_open) std::fputs("\r\033[K", stderr);
    line_open = false;
    std::fprintf(stderr, "raypager: %s%.*s\n", prefix, static_cast<int>(message.size()), message.data());
}

}  // namespace

void log_warning(std::string_view message) { print("warning: ", message); }
void log_note(std::string_view message) { print("", message); }
bool stderr_is_terminal() { return ::isatty(2) == 1; }

void progress_line(std::string_view text) {
    const std::lock_guard lock(mutex);
    if (!stderr_is_terminal()) {
        if (!text.empty()) std::fprintf(stderr, "%.*s\n", static_cast<int>(text.size()), text.data());
        return;
    }
    if (text.empty()) {
        if (line_open) std::fputc('\n', stderr);
        line_open = false;
        return;
    }
    std::fprintf(stderr, "\r%s\033[K", shortened(text, progress_columns).c_str());
    std::fflush(stderr);
    line_open = true;
}

}  // namespace raypager
