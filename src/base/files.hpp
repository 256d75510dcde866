// Files whose failures are values. Every write goes to a temporary file beside the target that is renamed when it is whole, so that
// a reader never sees half a file and a failed write leaves the old file as it was. Tests inject failures through FaultPlan.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "raypager/status.hpp"

namespace raypager {

// Fails the n-th read or write from now on (1 is the next; 0: never) with the given errno, or shortens it. For tests.
struct FaultPlan {
    std::atomic<int64_t> fail_read_in{0}, fail_write_in{0};
    std::atomic<int> error_number{0};  // 0: a short read or write instead of an error
};
FaultPlan& fault_plan();

// Positional reads; any number of threads may read at once.
class InputFile {
public:
    InputFile() = default;
    InputFile(InputFile&& other) noexcept;
    InputFile& operator=(InputFile&& other) noexcept;
    ~InputFile();
    static Result<InputFile> open(const std::filesystem::path& path);
    uint64_t size() const { return size_; }
    const std::filesystem::path& path() const { return path_; }
    // Fills all of bytes from offset on; a file that ends before is an error.
    Status read(uint64_t offset, std::span<std::byte> bytes) const;

private:
    int descriptor_ = -1;
    uint64_t size_ = 0;
    std::filesystem::path path_;
};

class OutputFile {
public:
    OutputFile() = default;
    OutputFile(OutputFile&& other) noexcept;
    OutputFile& operator=(OutputFile&& other) noexcept;
    ~OutputFile();  // removes the temporary file unless committed
    static Result<OutputFile> create(const std::filesystem::path& path);
    Status write(std::span<const std::byte> bytes);  // appends (buffered)
    Status write(std::string_view text);
    Status write_at(uint64_t offset, std::span<const std::byte> bytes);  // over bytes already written
    uint64_t position() const { return position_; }
    Status commit();  // flushes, syncs, renames

private:
    Status flush();
    int descriptor_ = -1;
    uint64_t position_ = 0;
    std::vector<std::byte> buffer_;
    std::filesystem::path path_, temporary_;
};

// The whole file; refuses more than limit bytes.
Result<std::string> read_text(const std::filesystem::path& path, uint64_t limit = uint64_t{1} << 30);
Status write_text(const std::filesystem::path& path, std::string_view text);
// Where a new file can be written under a temporary name: beside the target.
std::filesystem::path temporary_path(const std::filesystem::path& target);

}  // namespace raypager
