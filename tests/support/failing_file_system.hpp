// Files that fail on purpose: operations end in an error, come up short or take their time.
#pragma once

#include <atomic>
#include <cstdint>

#include "base/file_system.hpp"

namespace raypager::support {

// The file system of the process for as long as it lives; without a fault set, it is the plain one. Faults may be set while other threads use
// files: what is ahead of a load may still be read when a render is done. Who starts such threads makes this first.
// A countdown of n lets the n-th operation from now on fail (1: the next; 0: none), once.
class FailingFileSystem final : public FileSystem {
public:
    std::atomic<int64_t> fail_read_in{0}, fail_write_in{0}, fail_any_in{0};  // any: of all kinds
    std::atomic<int> error_number{0};                                        // of the failure; 0: a read or write comes up short instead
    // By a seed: every operation waits for up to so long, and one in so many reads and writes comes up short. 0: none.
    std::atomic<uint32_t> longest_delay_us{0}, one_short_in{0};
    std::atomic<uint32_t> seed{0};
    // Only reads of the file of this name, a literal, count for fail_read_in; null: reads of every file.
    std::atomic<const char*> only_file{nullptr};
    void clear();
    // Waits as an operation does, for what is no file but shall be shuffled, too.
    void delay();

    int open(const std::filesystem::path& path, int flags, mode_t mode) override;
    int create_unnamed(const std::filesystem::path& name) override;
    ssize_t pread(int descriptor, std::span<std::byte> bytes, uint64_t offset) override;
    ssize_t write(int descriptor, std::span<const std::byte> bytes) override;
    ssize_t pwrite(int descriptor, std::span<const std::byte> bytes, uint64_t offset) override;
    int fsync(int descriptor) override;
    int rename(const std::filesystem::path& from, const std::filesystem::path& to) override;

private:
    enum class FileOperation { open, create, read, write, sync, rename };
    enum class Fault { none, error, shortened };
    // What an operation shall do. error: fail with errno, which has been set. descriptor: that of a read.
    Fault fault(FileOperation operation, int descriptor = -1);
    bool fails(FileOperation operation) { return fault(operation) == Fault::error; }
    // The next number of a sequence. Which operation gets it depends on how threads happen to run.
    uint64_t next_random();

    std::atomic<uint64_t> drawn_{0};
    ScopedFileSystem in_place_{*this};
};

}  // namespace raypager::support
