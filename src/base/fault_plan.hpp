// Faults on purpose, for tests: operations on files that fail, come up short or take their time. Without a plan, an operation costs one
// look at a variable more.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>

namespace raypager {

enum class FileOperation { open, create, read, write, sync, rename };

// May be changed while other threads use files: what is ahead of a load may still be read when the render is done.
// A countdown of n lets the n-th operation from now on fail (1: the next; 0: none), once.
struct FaultPlan {
    std::atomic<int64_t> fail_read_in{0}, fail_write_in{0}, fail_any_in{0};  // any: of all kinds
    std::atomic<int> error_number{0};                                        // of the failure; 0: a read or write comes up short instead
    // By a seed: every operation waits for up to so long, and one in so many reads and writes comes up short. 0: none.
    std::atomic<uint32_t> longest_delay_us{0}, one_short_in{0};
    std::atomic<uint32_t> seed{0};
    // Only reads of the file of this name, a literal, count for fail_read_in; null: reads of every file.
    std::atomic<const char*> only_file{nullptr};
    // The last operation that a countdown hit.
    std::atomic<FileOperation> hit{FileOperation::open};
    void clear();
};
FaultPlan& fault_plan();

enum class Fault { none, error, shortened };
// What an operation shall do. error: fail with errno, which has been set. path: that of a read.
Fault inject_fault(FileOperation operation, const std::filesystem::path& path = {});
// Waits for as long as the plan says.
void inject_delay();

}  // namespace raypager
