#include "support/failing_file_system.hpp"

#include <fcntl.h>
#include <fmt/format.h>

#include <cerrno>
#include <chrono>
#include <thread>

namespace raypager::support {
namespace {

bool counted_down(std::atomic<int64_t>& countdown) { return countdown.load(std::memory_order_relaxed) > 0 && countdown.fetch_sub(1) == 1; }

// A descriptor knows its file, but only the system knows by what name.
bool is_named(int descriptor, const char* name) {
    std::error_code error;
    return std::filesystem::read_symlink(fmt::format("/proc/self/fd/{}", descriptor), error).filename() == name;
}

// At least one byte: none would be the end of the file.
template <class Byte>
std::span<Byte> half(std::span<Byte> bytes) {
    return bytes.first((bytes.size() + 1) / 2);
}

}  // namespace

void FailingFileSystem::clear() {
    fail_read_in = fail_write_in = fail_any_in = 0;
    error_number = 0;
    longest_delay_us = one_short_in = 0;
    only_file = nullptr;
}

uint64_t FailingFileSystem::next_random() {  // splitmix64
    uint64_t z = (drawn_.fetch_add(1) + seed.load()) * 0x9e3779b97f4a7c15u;
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
    z = (z ^ z >> 27) * 0x94d049bb133111ebu;
    return z ^ z >> 31;
}

void FailingFileSystem::delay() {
    if (const uint32_t longest = longest_delay_us.load(std::memory_order_relaxed))
        std::this_thread::sleep_for(std::chrono::microseconds(next_random() % (longest + 1)));
}

FailingFileSystem::Fault FailingFileSystem::fault(FileOperation operation, int descriptor) {
    delay();
    const bool transfer = operation == FileOperation::read || operation == FileOperation::write;
    bool struck = counted_down(fail_any_in);
    if (operation == FileOperation::write) struck |= counted_down(fail_write_in);
    const char* const only = only_file;
    if (operation == FileOperation::read && (!only || is_named(descriptor, only))) struck |= counted_down(fail_read_in);
    if (const int error = error_number; struck && error != 0) {
        errno = error;
        return Fault::error;
    }
    const uint32_t one_in = one_short_in.load(std::memory_order_relaxed);
    return transfer && (struck || (one_in && next_random() % one_in == 0)) ? Fault::shortened : Fault::none;
}

int FailingFileSystem::open(const std::filesystem::path& path, int flags, mode_t mode) {
    return fails(flags & O_CREAT ? FileOperation::create : FileOperation::open) ? -1 : FileSystem::open(path, flags, mode);
}

int FailingFileSystem::create_unnamed(const std::filesystem::path& name) {
    return fails(FileOperation::create) ? -1 : FileSystem::create_unnamed(name);
}

ssize_t FailingFileSystem::pread(int descriptor, std::span<std::byte> bytes, uint64_t offset) {
    const Fault now = fault(FileOperation::read, descriptor);
    return now == Fault::error ? -1 : FileSystem::pread(descriptor, now == Fault::shortened ? half(bytes) : bytes, offset);
}

ssize_t FailingFileSystem::write(int descriptor, std::span<const std::byte> bytes) {
    const Fault now = fault(FileOperation::write);
    return now == Fault::error ? -1 : FileSystem::write(descriptor, now == Fault::shortened ? half(bytes) : bytes);
}

ssize_t FailingFileSystem::pwrite(int descriptor, std::span<const std::byte> bytes, uint64_t offset) {
    const Fault now = fault(FileOperation::write);
    return now == Fault::error ? -1 : FileSystem::pwrite(descriptor, now == Fault::shortened ? half(bytes) : bytes, offset);
}

int FailingFileSystem::fsync(int descriptor) { return fails(FileOperation::sync) ? -1 : FileSystem::fsync(descriptor); }

int FailingFileSystem::rename(const std::filesystem::path& from, const std::filesystem::path& to) {
    return fails(FileOperation::rename) ? -1 : FileSystem::rename(from, to);
}

}  // namespace raypager::support
