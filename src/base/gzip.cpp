#include "base/gzip.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <list>
#include <mutex>

#include "base/log.hpp"
#include "raypager/import.hpp"

namespace raypager {
namespace {

constexpr size_t packed_at_once = size_t{256} << 10, unpacked_at_once = size_t{1} << 20;

// What is kept of files that are not open at the moment: few of them, since each takes a descriptor, and little disk.
constexpr size_t max_kept = 32;
constexpr uint64_t max_kept_bytes = uint64_t{4} << 30;

class Unpacker {
public:
    Unpacker(const InputFile& packed, SpillFile& content) : packed_(packed), content_(content), in_(packed_at_once), out_(unpacked_at_once) {}
    ~Unpacker() { (void)::inflateEnd(&stream_); }
    Unpacker(const Unpacker&) = delete;
    Unpacker& operator=(const Unpacker&) = delete;

    // Returns the size of the content.
    Result<uint64_t> run() {
        constexpr int gzip_window = 15 + 16;  // the largest, in gzip's own wrapping alone
        if (::inflateInit2(&stream_, gzip_window) != Z_OK) return bad("not enough memory to unpack it");
        while (true) {
            RAYPAGER_TRY(fill());
            if (stream_.avail_in == 0) return bad("ends before its packed content does; it is truncated");
            const int result = inflate_some();
            RAYPAGER_TRY(drain());
            if (result == Z_MEM_ERROR) return bad("not enough memory to unpack it");
            if (result != Z_OK && result != Z_STREAM_END && result != Z_BUF_ERROR)
                return bad(fmt::format("cannot be unpacked, the file is damaged at or before byte {}{}", at_ - stream_.avail_in, reason()));
            if (result != Z_STREAM_END) continue;
            auto more = next_member();
            if (!more) return more.status();
            if (!*more) return size_;
        }
    }

private:
    Status bad(const std::string& what) const { return Status::failed(packed_.path().string() + ": " + what); }
    std::string reason() const { return stream_.msg ? fmt::format(" ({})", stream_.msg) : ""; }

    Status fill() {
        if (stream_.avail_in > 0 || at_ == packed_.size()) return {};
        const auto bytes = std::span(in_).first(std::min<uint64_t>(in_.size(), packed_.size() - at_));
        RAYPAGER_TRY(packed_.read(at_, bytes));
        at_ += bytes.size();
        stream_.next_in = reinterpret_cast<Bytef*>(bytes.data());
        stream_.avail_in = static_cast<uInt>(bytes.size());
        return {};
    }

    int inflate_some() {
        stream_.next_out = reinterpret_cast<Bytef*>(out_.data());
        stream_.avail_out = static_cast<uInt>(out_.size());
        return ::inflate(&stream_, Z_NO_FLUSH);
    }

    Status drain() {
        const size_t count = out_.size() - stream_.avail_out;
        if (count == 0) return {};
        const auto written = content_.append(std::span(out_).first(count));
        if (!written) return bad(fmt::format("cannot be unpacked: {} (TMPDIR says where)", written.status().message()));
        size_ += count;
        return {};
    }

    // Whether another member follows the one that has ended. What is neither that nor padding is passed over, as by gzip.
    Result<bool> next_member() {
        const uint64_t begin = at_ - stream_.avail_in;
        bool zeros = true;
        while (true) {
            RAYPAGER_TRY(fill());
            if (stream_.avail_in == 0) return false;
            if (zeros && *stream_.next_in == 0x1f) break;
            zeros = zeros && *stream_.next_in == 0;
            if (!zeros) {
                log_warning(fmt::format("{}: {} bytes behind the end of its packed content are passed over", packed_.path().string(),
                                        packed_.size() - begin));
                return false;
            }
            ++stream_.next_in;
            --stream_.avail_in;
        }
        if (::inflateReset(&stream_) != Z_OK) return bad("cannot be unpacked");
        return true;
    }

    const InputFile& packed_;
    SpillFile& content_;
    std::vector<std::byte> in_, out_;
    z_stream stream_{};
    uint64_t at_ = 0, size_ = 0;  // read of packed_, written to content_
};

Result<std::shared_ptr<const UnpackedFile>> unpack(const InputFile& packed) {
    std::error_code error;
    const auto folder = std::filesystem::temp_directory_path(error);
    const auto content = SpillFile::create((error ? std::filesystem::path("/tmp") : folder) / packed.path().filename());
    if (!content) return content.status().at(packed.path().string() + ": cannot be unpacked");
    const auto size = Unpacker(packed, **content).run();
    if (!size) return size.status();
    return std::make_shared<const UnpackedFile>(UnpackedFile{*content, *size});
}

// Files that were unpacked, the last ones first, so that looking at a file and reading it later does not unpack it twice.
class UnpackedFiles {
public:
    Result<std::shared_ptr<const UnpackedFile>> get(const InputFile& packed, const FileIdentity& identity) {
        const auto entry = find(identity);
        const std::lock_guard lock(entry->mutex);  // who wants the same file waits for it here
        if (!entry->file) {
            auto file = unpack(packed);
            if (!file) return file.status();
            entry->file = std::move(*file);
            entry->bytes = entry->file->size;
        }
        return entry->file;
    }

    void forget() {
        const std::lock_guard lock(mutex_);
        entries_.clear();
    }

private:
    struct Entry {
        FileIdentity identity;
        std::mutex mutex;
        std::shared_ptr<const UnpackedFile> file;
        std::atomic<uint64_t> bytes{0};
    };

    std::shared_ptr<Entry> find(const FileIdentity& identity) {
        const std::lock_guard lock(mutex_);
        auto at = std::find_if(entries_.begin(), entries_.end(), [&](const auto& entry) { return entry->identity == identity; });
        if (at == entries_.end()) {
            entries_.push_front(std::make_shared<Entry>());
            entries_.front()->identity = identity;
        } else {
            entries_.splice(entries_.begin(), entries_, at);
        }
        uint64_t bytes = 0;
        size_t count = 0;
        std::erase_if(entries_, [&](const auto& entry) { return count++ > 0 && (count > max_kept || (bytes += entry->bytes) > max_kept_bytes); });
        return entries_.front();
    }

    std::mutex mutex_;
    std::list<std::shared_ptr<Entry>> entries_;
};

UnpackedFiles& unpacked_files() {
    static UnpackedFiles files;
    return files;
}

}  // namespace

bool looks_packed(const std::byte (&start)[3]) { return start[0] == std::byte{0x1f} && start[1] == std::byte{0x8b} && start[2] == std::byte{8}; }

Result<std::shared_ptr<const UnpackedFile>> unpacked_content(const InputFile& packed, const FileIdentity& identity) {
    return unpacked_files().get(packed, identity);
}

void forget_unpacked_files() { unpacked_files().forget(); }

}  // namespace raypager
