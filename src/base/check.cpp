#include "base/check.hpp"

#include <cstdio>
#include <cstdlib>

namespace raypager {

void check_failed(const char* expression, const char* file, int line) {
    std::fprintf(stderr, "raypager: bug: %s does not hold at %s:%d\n", expression, file, line);
    std::abort();
}

}  // namespace raypager
