#include "base/memory.hpp"

#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <sstream>
#include <string>
#include <string_view>

namespace raypager {
namespace {

// A number from a file of the kernel's; nothing if it is absent or says "max".
bool read_number(const char* path, uint64_t& value) {
    std::ifstream file(path);
    return static_cast<bool>(file >> value);
}

// The value behind a key in a file of lines such as "key: 123 kB" or "key 123", in bytes; 0 if there is none.
uint64_t read_entry(const char* path, std::string_view key) {
    std::ifstream file(path);
    for (std::string line; std::getline(file, line);) {
        std::istringstream words(line);
        std::string name, unit;
        uint64_t value = 0;
        if (words >> name >> value && (name == key || name == std::string(key) + ":")) return words >> unit && unit == "kB" ? value * 1024 : value;
    }
    return 0;
}

constexpr const char* group_statistics = "/sys/fs/cgroup/memory.stat";

}  // namespace

uint64_t available_memory() {
    // Cached files make room when memory is asked for: they count as free.
    uint64_t available = read_entry("/proc/meminfo", "MemAvailable");
    if (available == 0) {
        const long pages = ::sysconf(_SC_AVPHYS_PAGES), page = ::sysconf(_SC_PAGESIZE);
        available = pages > 0 && page > 0 ? static_cast<uint64_t>(pages) * static_cast<uint64_t>(page) : uint64_t{1} << 30;
    }
    uint64_t limit = 0, used = 0;
    if (read_number("/sys/fs/cgroup/memory.max", limit) && read_number("/sys/fs/cgroup/memory.current", used)) {
        used -= std::min(used, read_entry(group_statistics, "inactive_file") + read_entry(group_statistics, "active_file"));
        available = std::min(available, limit > used ? limit - used : 0);
    }
    return available;
}

uint64_t total_memory() {
    uint64_t total = read_entry("/proc/meminfo", "MemTotal"), limit = 0;
    if (total == 0) {
        const long pages = ::sysconf(_SC_PHYS_PAGES), page = ::sysconf(_SC_PAGESIZE);
        total = pages > 0 && page > 0 ? static_cast<uint64_t>(pages) * static_cast<uint64_t>(page) : uint64_t{1} << 30;
    }
    return read_number("/sys/fs/cgroup/memory.max", limit) ? std::min(total, limit) : total;
}

DefaultLimit default_limit(uint64_t usual, uint64_t available) { return {std::min(usual, available / 8 * 7), usual}; }

uint64_t process_memory() { return read_entry("/proc/self/status", "VmRSS"); }
uint64_t peak_process_memory() { return read_entry("/proc/self/status", "VmHWM"); }

}  // namespace raypager
