#include "base/files.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "base/file_system.hpp"
#include "base/gzip.hpp"

namespace raypager {
namespace {

constexpr size_t buffer_bytes = size_t{1} << 20;
constexpr uint64_t stripe_bytes = uint64_t{1} << 20;  // of scratch space in several files

Status system_error(const std::filesystem::path& path, const char* what) {
    return Status::failed(fmt::format("{}: {}: {}", path.string(), what, std::strerror(errno)));
}

FileSystem& file_system() { return FileSystem::current(); }

// offset -1: where the file's position is.
bool write_all(int descriptor, std::span<const std::byte> bytes, int64_t offset) {
    while (!bytes.empty()) {
        const ssize_t done =
            offset < 0 ? file_system().write(descriptor, bytes) : file_system().pwrite(descriptor, bytes, static_cast<uint64_t>(offset));
        if (done < 0 && errno == EINTR) continue;
        if (done < 0) return false;
        if (offset >= 0) offset += done;
        bytes = bytes.subspan(static_cast<size_t>(done));
    }
    return true;
}

// How many bytes came: fewer than asked for after an error, or with errno 0 at the end of the file.
size_t read_all(int descriptor, uint64_t offset, std::span<std::byte> bytes) {
    size_t total = 0;
    while (total < bytes.size()) {
        const ssize_t done = file_system().pread(descriptor, bytes.subspan(total), offset + total);
        if (done < 0 && errno == EINTR) continue;
        if (done == 0) errno = 0;
        if (done <= 0) return total;
        total += static_cast<size_t>(done);
    }
    return total;
}

enum class Lock { taken, held, unavailable };

// Held until the descriptor is closed, by its process's death at the latest. Some network file systems have no locks.
Lock try_lock(int descriptor) {
    if (::flock(descriptor, LOCK_EX | LOCK_NB) == 0) return Lock::taken;
    return errno == EWOULDBLOCK ? Lock::held : Lock::unavailable;
}

// The stem of the target that a temporary file is for (see temporary_path); empty if its name is not of that kind.
std::string_view stem_of_temporary(std::string_view name, std::string_view extension) {
    const std::string ending = ".tmp" + std::string(extension);
    if (!name.starts_with('.') || !name.ends_with(ending)) return {};
    name.remove_prefix(1);
    name.remove_suffix(std::min(ending.size(), name.size()));
    const size_t dot = name.rfind('.');
    if (dot == std::string_view::npos || dot + 1 == name.size()) return {};
    return name.find_first_not_of("0123456789", dot + 1) == std::string_view::npos ? name.substr(0, dot) : std::string_view();
}

// Opens a temporary file, empty and locked. errno says why if the result is -1; EWOULDBLOCK: somebody else is writing it.
int open_locked(const std::filesystem::path& path) {
    while (true) {
        const int descriptor = file_system().open(path, O_RDWR | O_CREAT | O_CLOEXEC, 0644);
        if (descriptor < 0) return -1;
        struct stat info {};
        const Lock lock = try_lock(descriptor);
        // Between the two calls it may have been taken for abandoned, and removed: then there is no such name any more.
        if (lock != Lock::held && ::fstat(descriptor, &info) == 0 && info.st_nlink > 0 && ::ftruncate(descriptor, 0) == 0) return descriptor;
        const int error = lock == Lock::held ? EWOULDBLOCK : errno;
        ::close(descriptor);
        if (lock == Lock::held || info.st_nlink > 0) {
            errno = error;
            return -1;
        }
    }
}

}  // namespace

InputFile::InputFile(InputFile&& other) noexcept { *this = std::move(other); }

InputFile& InputFile::operator=(InputFile&& other) noexcept {
    std::swap(descriptor_, other.descriptor_);
    std::swap(size_, other.size_);
    std::swap(path_, other.path_);
    std::swap(unpacked_, other.unpacked_);
    return *this;
}

InputFile::~InputFile() {
    if (descriptor_ >= 0) ::close(descriptor_);
}

Result<InputFile> InputFile::open(const std::filesystem::path& path) {
    InputFile file;
    file.path_ = path;
    // Nonblocking: a pipe of that name must be refused, not waited for. Regular files do not care.
    file.descriptor_ = file_system().open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK, 0);
    if (file.descriptor_ < 0) return system_error(path, "cannot be opened");
    struct stat info {};
    if (::fstat(file.descriptor_, &info) != 0) return system_error(path, "cannot be examined");
    if (!S_ISREG(info.st_mode)) return Status::failed(path.string() + ": is not a regular file");
    file.size_ = static_cast<uint64_t>(info.st_size);
    std::byte start[3];
    if (file.size_ < sizeof(start)) return file;
    if (read_all(file.descriptor_, 0, start) < sizeof(start)) {
        if (errno) return system_error(path, "cannot be read");
        return file;
    }
    if (!looks_packed(start)) return file;
    auto unpacked = unpacked_content(file, {info.st_dev, info.st_ino, file.size_, info.st_mtim.tv_sec, info.st_mtim.tv_nsec});
    if (!unpacked) return unpacked.status();
    file.unpacked_ = std::move(*unpacked);
    file.size_ = file.unpacked_->size;
    ::close(std::exchange(file.descriptor_, -1));
    return file;
}

Status InputFile::read(uint64_t offset, std::span<std::byte> bytes) const {
    if (offset > size_ || bytes.size() > size_ - offset)
        return Status::failed(fmt::format("{}: ends at byte {}, but {} bytes from byte {} on are needed; the file is truncated", path_.string(),
                                          size_, bytes.size(), offset));
    if (unpacked_) return unpacked_->content->read(offset, bytes);
    const size_t done = read_all(descriptor_, offset, bytes);
    if (done == bytes.size()) return {};
    if (errno) return system_error(path_, "cannot be read");
    return Status::failed(fmt::format("{}: ended at byte {} while it was read", path_.string(), offset + done));
}

OutputFile::OutputFile(OutputFile&& other) noexcept { *this = std::move(other); }

OutputFile& OutputFile::operator=(OutputFile&& other) noexcept {
    std::swap(descriptor_, other.descriptor_);
    std::swap(position_, other.position_);
    std::swap(handed_on_, other.handed_on_);
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
    remove_abandoned_temporaries(path);
    OutputFile file;
    file.path_ = path;
    file.temporary_ = temporary_path(path);
    file.descriptor_ = open_locked(file.temporary_);
    if (file.descriptor_ < 0 && errno == EWOULDBLOCK)
        return Status::failed(fmt::format("{}: is being written by another process at this moment", path.string()));
    if (file.descriptor_ < 0) return system_error(path, "cannot be written");
    file.buffer_.reserve(buffer_bytes);
    return file;
}

Status OutputFile::flush() {
    if (buffer_.empty()) return {};
    if (!write_all(descriptor_, buffer_, -1)) return system_error(path_, "cannot be written");
    buffer_.clear();
    hand_on();
    return {};
}

// Has the disk begin with what it will be waited for in commit().
void OutputFile::hand_on() {
    constexpr uint64_t least = uint64_t{4} << 20;
    if (position_ < handed_on_ + least) return;
#ifdef __linux__
    (void)::sync_file_range(descriptor_, static_cast<off_t>(handed_on_), static_cast<off_t>(position_ - handed_on_), SYNC_FILE_RANGE_WRITE);
#endif
    handed_on_ = position_;
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

Status OutputFile::skip(uint64_t bytes) {
    RAYPAGER_TRY(flush());
    if (::lseek(descriptor_, static_cast<off_t>(bytes), SEEK_CUR) < 0) return system_error(path_, "cannot be written");
    position_ += bytes;
    return {};
}

Status OutputFile::write_at(uint64_t offset, std::span<const std::byte> bytes) {
    RAYPAGER_TRY(flush());
    if (!write_all(descriptor_, bytes, static_cast<int64_t>(offset))) return system_error(path_, "cannot be written");
    return {};
}

Status OutputFile::commit() {
    RAYPAGER_TRY(flush());
    if (file_system().fsync(descriptor_) != 0) return system_error(path_, "cannot be written");
    if (file_system().rename(temporary_, path_) != 0) return system_error(path_, "cannot be put in place");
    ::close(descriptor_);
    descriptor_ = -1;
    return {};
}

GrowingFile::GrowingFile(GrowingFile&& other) noexcept { *this = std::move(other); }

GrowingFile& GrowingFile::operator=(GrowingFile&& other) noexcept {
    std::swap(descriptor_, other.descriptor_);
    std::swap(size_, other.size_);
    std::swap(path_, other.path_);
    return *this;
}

GrowingFile::~GrowingFile() {
    if (descriptor_ >= 0) ::close(descriptor_);
}

Result<GrowingFile> GrowingFile::create(const std::filesystem::path& path) { return open(path, O_CREAT | O_TRUNC); }
Result<GrowingFile> GrowingFile::reopen(const std::filesystem::path& path) { return open(path, O_CREAT); }

Result<GrowingFile> GrowingFile::open(const std::filesystem::path& path, int flags) {
    GrowingFile file;
    file.path_ = path;
    file.descriptor_ = file_system().open(path, O_WRONLY | O_CLOEXEC | flags, 0644);
    if (file.descriptor_ < 0) return system_error(path, "cannot be written");
    if (const off_t end = ::lseek(file.descriptor_, 0, SEEK_END); end > 0) file.size_ = static_cast<uint64_t>(end);
    return file;
}

Status GrowingFile::append(std::string_view text) {
    if (write_all(descriptor_, std::as_bytes(std::span(text)), -1)) {
        size_ += text.size();
        return {};
    }
    const Status error = system_error(path_, "cannot be written");
    // No half a row stays (in a file; a terminal or a pipe keeps what it got).
    if (::ftruncate(descriptor_, static_cast<off_t>(size_)) == 0) ::lseek(descriptor_, static_cast<off_t>(size_), SEEK_SET);
    return error;
}

namespace {

// Whether the file still has this name: its writer may have put it in place since, and have begun another.
bool is_named(int descriptor, const std::filesystem::path& path) {
    struct stat opened = {};
    struct stat named = {};
    return ::fstat(descriptor, &opened) == 0 && ::lstat(path.c_str(), &named) == 0 && opened.st_dev == named.st_dev && opened.st_ino == named.st_ino;
}

}  // namespace

size_t remove_abandoned_temporaries(const std::filesystem::path& folder, std::string_view extension,
                                    const std::function<bool(std::string_view stem)>& is_target) {
    size_t removed = 0;
    std::error_code error;
    for (std::filesystem::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
        const std::string name = entry->path().filename().string();
        const std::string_view stem = stem_of_temporary(name, extension);
        if (stem.empty() || !is_target(stem)) continue;
        const int descriptor = file_system().open(entry->path(), O_RDWR | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK, 0);
        if (descriptor < 0) continue;
        if (try_lock(descriptor) == Lock::taken && is_named(descriptor, entry->path()) && ::unlink(entry->path().c_str()) == 0) removed++;
        ::close(descriptor);
    }
    return removed;
}

size_t remove_abandoned_temporaries(const std::filesystem::path& target) {
    return remove_abandoned_temporaries(target.has_parent_path() ? target.parent_path() : ".", target.extension().string(),
                                        [stem = target.stem().string()](std::string_view other) { return other == stem; });
}

Result<std::shared_ptr<SpillFile>> SpillFile::create(const std::filesystem::path& beside, size_t files) {
    const std::filesystem::path folder = beside.has_parent_path() ? beside.parent_path() : ".";
    std::filesystem::path name = temporary_path(beside);
    name += ".spill";
    std::shared_ptr<SpillFile> space(new SpillFile(folder));
    for (size_t i = 0; i < files; i++) {
        const int descriptor = file_system().create_unnamed(name);
        if (descriptor < 0) return system_error(folder, "no scratch file can be made there");
        space->descriptors_.push_back(descriptor);
    }
    return space;
}

SpillFile::~SpillFile() {
    for (const int descriptor : descriptors_) ::close(descriptor);
}

template <class Visit>
bool SpillFile::for_each_piece(uint64_t offset, uint64_t bytes, const Visit& visit) const {
    const uint64_t files = descriptors_.size();
    if (files == 1) return visit(descriptors_[0], offset, 0, bytes);
    for (uint64_t before = 0; before < bytes;) {
        const uint64_t stripe = (offset + before) / stripe_bytes, within = (offset + before) % stripe_bytes;
        const uint64_t part = std::min(bytes - before, stripe_bytes - within);
        if (!visit(descriptors_[stripe % files], stripe / files * stripe_bytes + within, before, part)) return false;
        before += part;
    }
    return true;
}

Result<uint64_t> SpillFile::append(std::span<const std::byte> bytes) {
    const uint64_t offset = reserve(bytes.size());
    if (auto status = write(offset, bytes); !status.ok()) return status;
    return offset;
}

Status SpillFile::write(uint64_t offset, std::span<const std::byte> bytes) {
    const auto write = [&](int descriptor, uint64_t at, uint64_t before, uint64_t count) {
        return write_all(descriptor, bytes.subspan(before, count), static_cast<int64_t>(at));
    };
    if (!for_each_piece(offset, bytes.size(), write))
        return Status::failed(fmt::format("{}: a scratch file of {:.1f} GiB there cannot grow: {}; free space, or write to another disk",
                                          folder_.string(), static_cast<double>(offset) / (1 << 30), std::strerror(errno)));
    return {};
}

Status SpillFile::read(uint64_t offset, std::span<std::byte> bytes) const {
    size_t done = 0;
    const auto read = [&](int descriptor, uint64_t at, uint64_t before, uint64_t count) {
        const size_t came = read_all(descriptor, at, bytes.subspan(before, count));
        done += came;
        return came == count;
    };
    if (!for_each_piece(offset, bytes.size(), read))
        return Status::failed(fmt::format("{}: a scratch file there cannot be read at byte {}: {}", folder_.string(), offset + done,
                                          errno ? std::strerror(errno) : "it has ended"));
    return {};
}

void SpillFile::discard(uint64_t offset, uint64_t bytes) const {
#ifdef FALLOC_FL_PUNCH_HOLE
    for_each_piece(offset, bytes, [](int descriptor, uint64_t at, uint64_t, uint64_t count) {
        (void)::fallocate(descriptor, FALLOC_FL_PUNCH_HOLE | FALLOC_FL_KEEP_SIZE, static_cast<off_t>(at), static_cast<off_t>(count));
        return true;
    });
#else
    (void)offset, (void)bytes;
#endif
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
