#include "base/memory.hpp"

#include <unistd.h>

#include <algorithm>
#include <fstream>

namespace raypager {
namespace {

// A number from a file of the kernel's; nothing if it is absent or says "max".
bool read_number(const char* path, uint64_t& value) {
    std::ifstream file(path);
    return static_cast<bool>(file >> value);
}

}  // namespace

uint64_t available_memory() {
    const long pages = ::sysconf(_SC_AVPHYS_PAGES), page = ::sysconf(_SC_PAGESIZE);
    uint64_t available = pages > 0 && page > 0 ? static_cast<uint64_t>(pages) * static_cast<uint64_t>(page) : uint64_t{1} << 30;
    uint64_t limit = 0, used = 0;
    if (read_number("/sys/fs/cgroup/memory.max", limit) && read_number("/sys/fs/cgroup/memory.current", used))
        available = std::min(available, limit > used ? limit - used : 0);
    return available;
}

}  // namespace raypager
