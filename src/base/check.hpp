// Assertions for bugs, on in every build: out of core, a wrong picture is worse than a stop.
#pragma once

namespace raypager {
[[noreturn]] void check_failed(const char* expression, const char* file, int line);
}

#define RAYPAGER_CHECK(expression) ((expression) ? void(0) : ::raypager::check_failed(#expression, __FILE__, __LINE__))
