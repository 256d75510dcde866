// Files whose failures are values. Every write goes to a temporary file beside the target that is renamed when it is whole, so that
// a reader never sees half a file and a failed write leaves the old file as it was. All of it goes through FileSystem.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "raypager/status.hpp"

namespace raypager {

struct UnpackedFile;

// Positional reads; any number of threads may read at once. A file that is packed with gzip, whatever its name, reads as what was packed.
class InputFile {
public:
    InputFile() = default;
    InputFile(InputFile&& other) noexcept;
    InputFile& operator=(InputFile&& other) noexcept;
    ~InputFile();
    static Result<InputFile> open(const std::filesystem::path& path);
    uint64_t size() const { return size_; }  // of the content
    const std::filesystem::path& path() const { return path_; }
    bool is_open() const { return descriptor_ >= 0 || unpacked_; }
    // Fills all of bytes from offset on; a file that ends before is an error.
    Status read(uint64_t offset, std::span<std::byte> bytes) const;

private:
    int descriptor_ = -1;
    uint64_t size_ = 0;
    std::filesystem::path path_;
    std::shared_ptr<const UnpackedFile> unpacked_;  // null: it is read as it is
};

// The temporary file is locked while it is written, so that one whose writer was killed can be told from one that still grows.
class OutputFile {
public:
    OutputFile() = default;
    OutputFile(OutputFile&& other) noexcept;
    OutputFile& operator=(OutputFile&& other) noexcept;
    ~OutputFile();  // removes the temporary file unless committed
    // Removes what writers of this file have left behind that were killed.
    static Result<OutputFile> create(const std::filesystem::path& path);
    Status write(std::span<const std::byte> bytes);  // appends (buffered)
    Status write(std::string_view text);
    Status skip(uint64_t bytes);  // leaves room, zeros until they are written
    // Over bytes already written, or skipped; any number of threads at once while nobody appends.
    Status write_at(uint64_t offset, std::span<const std::byte> bytes);
    uint64_t position() const { return position_; }
    Status commit();  // flushes, syncs, renames

private:
    Status flush();
    void hand_on();
    int descriptor_ = -1;
    uint64_t position_ = 0;
    uint64_t handed_on_ = 0;  // to the disk
    std::vector<std::byte> buffer_;
    std::filesystem::path path_, temporary_;
};

// A file that others read while it grows, such as a log: what is appended has reached the file when the call returns, or none of it.
class GrowingFile {
public:
    GrowingFile() = default;
    GrowingFile(GrowingFile&& other) noexcept;
    GrowingFile& operator=(GrowingFile&& other) noexcept;
    ~GrowingFile();
    static Result<GrowingFile> create(const std::filesystem::path& path);  // empties a file that is there
    static Result<GrowingFile> reopen(const std::filesystem::path& path);  // goes on at its end
    Status append(std::string_view text);
    bool is_open() const { return descriptor_ >= 0; }

private:
    static Result<GrowingFile> open(const std::filesystem::path& path, int flags);
    int descriptor_ = -1;
    uint64_t size_ = 0;
    std::filesystem::path path_;
};

// Scratch space on disk: a file that has no name, so that nothing is left of it however the process ends.
class SpillFile {
public:
    // Files that it is made of where all threads write at once: systems let one thread at a time write to a file.
    static constexpr size_t for_all_threads = 8;
    // In the folder of `beside`.
    static Result<std::shared_ptr<SpillFile>> create(const std::filesystem::path& beside, size_t files = 1);
    ~SpillFile();
    SpillFile(const SpillFile&) = delete;
    SpillFile& operator=(const SpillFile&) = delete;
    // Writes behind what is there; returns where. Any number of threads at once. What fails leaves a hole.
    Result<uint64_t> append(std::span<const std::byte> bytes);
    // A place behind what is there, for what is to be written in any order.
    uint64_t reserve(uint64_t bytes) { return end_.fetch_add(bytes); }
    // Any number of threads at once. REQUIRES: a range that was reserved.
    Status write(uint64_t offset, std::span<const std::byte> bytes);
    // Any number of threads may read at once. REQUIRES: a range that was written.
    Status read(uint64_t offset, std::span<std::byte> bytes) const;
    // Gives the space of a range back that nobody will read again, where the file system can.
    void discard(uint64_t offset, uint64_t bytes) const;

private:
    explicit SpillFile(std::filesystem::path folder) : folder_(std::move(folder)) {}
    // Calls visit(descriptor, offset in its file, bytes before, bytes) for the pieces of a range, until it returns false.
    template <class Visit>
    bool for_each_piece(uint64_t offset, uint64_t bytes, const Visit& visit) const;

    std::vector<int> descriptors_;  // of the files: stripes of the space are in one after the other
    const std::filesystem::path folder_;
    std::atomic<uint64_t> end_{0};
};

// The whole file; refuses more than limit bytes.
Result<std::string> read_text(const std::filesystem::path& path, uint64_t limit = uint64_t{1} << 30);
Status write_text(const std::filesystem::path& path, std::string_view text);
// Where a new file can be written under a temporary name: beside the target.
std::filesystem::path temporary_path(const std::filesystem::path& target);
// Removes temporary files in folder that killed processes have left behind: those of targets with this extension (".rpb") whose stem
// (the name without it) is_target accepts. Best effort. Returns how many there were.
size_t remove_abandoned_temporaries(const std::filesystem::path& folder, std::string_view extension,
                                    const std::function<bool(std::string_view stem)>& is_target);
// Those of one target. For writers of large files to call before they begin.
size_t remove_abandoned_temporaries(const std::filesystem::path& target);

}  // namespace raypager
