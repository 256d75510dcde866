// What files.cpp asks of the operating system, in one place that can be replaced: a class that derives from this one lets operations fail, come up
// short or take their time, and whoever opens files by path need not know.
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>

namespace raypager {

// As it is: what POSIX does, results and errno included. Any number of threads at once.
class FileSystem {
public:
    virtual ~FileSystem() = default;
    virtual int open(const std::filesystem::path& path, int flags, mode_t mode);
    // Opens an empty file for reading and writing that has no name and lies in the folder of this one, which is used for a moment where files must
    // have one.
    virtual int create_unnamed(const std::filesystem::path& name);
    virtual ssize_t pread(int descriptor, std::span<std::byte> bytes, uint64_t offset);
    virtual ssize_t write(int descriptor, std::span<const std::byte> bytes);
    virtual ssize_t pwrite(int descriptor, std::span<const std::byte> bytes, uint64_t offset);
    virtual int fsync(int descriptor);
    virtual int rename(const std::filesystem::path& from, const std::filesystem::path& to);

    // The one that all files of the process go through.
    static FileSystem& current();
};

// Puts another in the place of the current one until this is destroyed. Descriptors stay what they are, so it may be done while files are open. But
// a thread that uses them (reads ahead, for instance) may have asked for the current one just before: the replacement must outlive every such
// operation. Where several are put in place, the last goes first.
class ScopedFileSystem {
public:
    explicit ScopedFileSystem(FileSystem& replacement);
    ~ScopedFileSystem();
    ScopedFileSystem(const ScopedFileSystem&) = delete;
    ScopedFileSystem& operator=(const ScopedFileSystem&) = delete;

private:
    FileSystem& before_;
};

}  // namespace raypager
