// The program as a process of its own: to be killed at any moment, or weighed from outside.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace raypager::support {

inline constexpr double patience = 120;  // seconds for one run, on a busy machine with no kernel in any cache
inline constexpr uint64_t MiB = uint64_t{1} << 20;

struct ChildResult {
    int exit_code = -1;       // -1: ended by a signal
    int signal = 0;           // that ended it
    uint64_t peak_bytes = 0;  // largest resident set, but for the last few milliseconds
};

class ChildProcess {
public:
    // Runs program with arguments in folder; its output goes to the files "stdout" and "stderr" there. Throws if that fails.
    // environment: "NAME=VALUE", beside that of this process.
    ChildProcess(const std::filesystem::path& program, const std::vector<std::string>& arguments, const std::filesystem::path& folder,
                 const std::vector<std::string>& environment = {});
    ~ChildProcess();  // kills it if it still runs
    ChildProcess(const ChildProcess&) = delete;
    ChildProcess& operator=(const ChildProcess&) = delete;

    void signal(int number) const;
    // Waits for its end. False if that does not come within so many seconds.
    bool wait(double seconds, ChildResult& result);

private:
    pid_t id_ = -1;
};

}  // namespace raypager::support
