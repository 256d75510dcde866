#include "base/files.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace raypager {
namespace {

constexpr size_t buffer_bytes = size_t{1} << 20;

// What a transfer of n bytes shall do under the fault plan: -1 fail with errno set, 0 nothing special, 1 cut short.
int injected(std::atomic<int64_t>& countdown) {
    if (countdown.load(std::memory_order_relaxed) <= 0 || countdown.fetch_sub(1) != 1) return 0;
    const int error = fault_plan().error_number;
    if (error == 0) return 1;
    errno = error;
    return -1;
}

Status system_error(const std::filesystem::path& path, const char* what) {
    return Status::failed(fmt::format("{}: {}: {}", path.string(), what, std::strerror(errno)));
}

bool write_all(int descriptor, std::span<const std::byte> bytes, int64_t offset) {
    while (!bytes.empty()) {
        const int fault = injected(fault_plan().fail_write_in);
        if (fault < 0) return false;
        const size_t count = fault > 0 ? (bytes.size() + 1) / 2 : bytes.size();
        const ssize_t done = offset < 0 ? ::write(descriptor, bytes.data(), count) : ::pwrite(descriptor, bytes.data(), count, offset);
        if (done < 0 && errno == EINTR) continue;
        if (done < 0) return false;
        if (offset >= 0) offset += done;
        bytes = bytes.subspan(static_cast<size_t>(done));
    }
    return true;
}

}  // namespace

FaultPlan& fault_plan() {
    static FaultPlan plan;
    return plan;
}

InputFile::InputFile(InputFile&& other) noexcept { *this = std::move(other); }

InputFile& InputFile::operator=(InputFile&& other) noexcept {
    std::swap(descriptor_, other.descriptor_);
    std::swap(size_, other.size_);
    std::swap(path_, other.path_);
    return *this;
}

InputFile::~InputFile() {
    if (descriptor_ >= 0) ::close(descriptor_);
}

Result<InputFile> InputFile::open(const std::filesystem::path& path) {
    InputFile file;
    file.path_ = path;
    file.descriptor_ = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
    if (file.descriptor_ < 0) return system_error(path, "cannot be opened");
    struct stat info {};
    if (::fstat(file.descriptor_, &info) != 0) return system_error(path, "cannot be examined");
    if (!S_ISREG(info.st_mode)) return Status::failed(path.string() + ": is not a regular file");
    file.size_ = static_cast<uint64_t>(info.st_size);
    return file;
}

Status InputFile::read(uint64_t offset, std::span<std::byte> bytes) const {
    if (offset > size_ || bytes.size() > size_ - offset)
        return Status::failed(fmt::format("{}: ends at byte {}, but {} bytes from byte {} on are needed; the file is truncated", path_.string(),
                                          size_, bytes.size(), offset));
    while (!bytes.empty()) {
        const int fault = injected(fault_plan().fail_read_in);
        if (fault < 0) return system_error(path_, "cannot be read");
        const size_t count = fault > 0 ? (bytes.size() + 1) / 2 : bytes.size();
        const ssize_t done = ::pread(descriptor_, bytes.data(), count, static_cast<off_t>(offset));
        if (done < 0 && errno == EINTR) continue;
        if (done < 0) return system_error(path_, "cannot be read");
        if (done == 0) return Status::failed(fmt::format("{}: ended at byte {} while it was read", path_.string(), offset));
        offset += static_cast<uint64_t>(done);
        bytes = bytes.subspan(static_cast<size_t>(done));
    }
    return {};
}

OutputFile::OutputFile(OutputFile&& other) noexcept { *this = std::move(other); }

OutputFile& OutputFile::operator=(OutputFile&& other) noexcept {
    std::swap(descriptor_, other.descriptor_);
    std::swap(position_, other.position_);
    std::swap(buffer_, other.buffer_);
    std::swap(path_, other.path_);
    std::swap(temporary_, other.temporary_);
    return *this;
}

OutputFile::~OutputFile() {
    if (descriptor_ < 0) return;
    ::close(descriptor_);
    ::unlink(temporary_.c_str());
}

std::filesystem::path temporary_path(const std::filesystem::path& target) {
    std::filesystem::path result = target;
    // The ending stays last: some writers choose the format by it.
    result.replace_filename(fmt::format(".{}.{}.tmp{}", target.stem().string(), ::getpid(), target.extension().string()));
    return result;
}

Result<OutputFile> OutputFile::create(const std::filesystem::path& path) {
    OutputFile file;
    file.path_ = path;
    file.temporary_ = temporary_path(path);
    file.descriptor_ = ::open(file.temporary_.c_str(), O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
    if (file.descriptor_ < 0) return system_error(path, "cannot be written");
    file.buffer_.reserve(buffer_bytes);
    return file;
}

Status OutputFile::flush() {
    if (buffer_.empty()) return {};
    if (!write_all(descriptor_, buffer_, -1)) return system_error(path_, "cannot be written");
    buffer_.clear();
    return {};
}

Status OutputFile::write(std::span<const std::byte> bytes) {
    if (buffer_.size() + bytes.size() > buffer_bytes) RAYPAGER_TRY(flush());
    if (bytes.size() >= buffer_bytes) {
        if (!write_all(descriptor_, bytes, -1)) return system_error(path_, "cannot be written");
    } else {
        buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
    }
    position_ += bytes.size();
    return {};
}

Status OutputFile::write(std::string_view text) { return write(std::as_bytes(std::span(text))); }

Status OutputFile::write_at(uint64_t offset, std::span<const std::byte> bytes) {
    RAYPAGER_TRY(flush());
    if (!write_all(descriptor_, bytes, static_cast<int64_t>(offset))) return system_error(path_, "cannot be written");
    return {};
}

Status OutputFile::commit() {
    RAYPAGER_TRY(flush());
    if (::fsync(descriptor_) != 0) return system_error(path_, "cannot be written");
    if (::rename(temporary_.c_str(), path_.c_str()) != 0) return system_error(path_, "cannot be put in place");
    ::close(descriptor_);
    descriptor_ = -1;
    return {};
}

Result<std::string> read_text(const std::filesystem::path& path, uint64_t limit) {
    auto file = InputFile::open(path);
    if (!file) return file.status();
    if (file->size() > limit)
        return Status::failed(fmt::format("{}: has {} bytes; at most {} are accepted here", path.string(), file->size(), limit));
    std::string text(file->size(), '\0');
    RAYPAGER_TRY(file->read(0, std::as_writable_bytes(std::span(text))));
    return text;
}

Status write_text(const std::filesystem::path& path, std::string_view text) {
    auto file = OutputFile::create(path);
    if (!file) return file.status();
    RAYPAGER_TRY(file->write(text));
    return file->commit();
}

}  // namespace raypager
