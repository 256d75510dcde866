#include "base/file_system.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <atomic>
#include <cstdio>

namespace raypager {
namespace {

std::atomic<FileSystem*>& current_pointer() {
    static FileSystem posix;
    static std::atomic<FileSystem*> current{&posix};
    return current;
}

}  // namespace

int FileSystem::open(const std::filesystem::path& path, int flags, mode_t mode) { return ::open(path.c_str(), flags, mode); }

int FileSystem::create_unnamed(const std::filesystem::path& name) {
    int descriptor = -1;
#ifdef O_TMPFILE
    const std::filesystem::path folder = name.has_parent_path() ? name.parent_path() : ".";
    descriptor = ::open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
#endif
    // Some file systems have none without a name: it loses it at once.
    if (descriptor < 0) {
        descriptor = ::open(name.c_str(), O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
        if (descriptor >= 0) ::unlink(name.c_str());
    }
    return descriptor;
}

ssize_t FileSystem::pread(int descriptor, std::span<std::byte> bytes, uint64_t offset) {
    return ::pread(descriptor, bytes.data(), bytes.size(), static_cast<off_t>(offset));
}

ssize_t FileSystem::write(int descriptor, std::span<const std::byte> bytes) { return ::write(descriptor, bytes.data(), bytes.size()); }

ssize_t FileSystem::pwrite(int descriptor, std::span<const std::byte> bytes, uint64_t offset) {
    return ::pwrite(descriptor, bytes.data(), bytes.size(), static_cast<off_t>(offset));
}

int FileSystem::fsync(int descriptor) { return ::fsync(descriptor); }

int FileSystem::rename(const std::filesystem::path& from, const std::filesystem::path& to) { return ::rename(from.c_str(), to.c_str()); }

FileSystem& FileSystem::current() { return *current_pointer().load(std::memory_order_acquire); }

ScopedFileSystem::ScopedFileSystem(FileSystem& replacement) : before_(*current_pointer().exchange(&replacement)) {}
ScopedFileSystem::~ScopedFileSystem() { current_pointer().store(&before_); }

}  // namespace raypager
