#include "import/line_reader.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "import/text.hpp"

namespace raypager {
namespace {

constexpr size_t read_at_once = size_t{64} << 10;
constexpr size_t longest_line = size_t{16} << 20;

}  // namespace

// The next line end from `searched` on. If it is not known before more is read, searched is set to where to go on.
std::optional<LineReader::LineEnd> LineReader::find_end(size_t& searched) const {
    const bool whole = offset_ >= file_.size();
    size_t stop = 0;
    if (!carriage_returns_) {
        stop = std::min(buffer_.find('\n', searched), buffer_.size());
    } else {
        for (stop = searched; stop < buffer_.size() && buffer_[stop] != '\n' && buffer_[stop] != '\r';) ++stop;
    }
    searched = stop;
    if (stop == buffer_.size()) return whole ? std::optional<LineEnd>({stop, stop, stop == at_}) : std::nullopt;
    if (buffer_[stop] == '\n') return LineEnd{stop, stop + 1, false};
    // What counts as one end is \r, \r\n, and \r\r\n, which files have that were converted twice.
    if (stop + 2 >= buffer_.size() && !whole) return std::nullopt;
    const std::string_view ending = std::string_view(buffer_).substr(stop, 3);
    if (ending.substr(1).starts_with('\n')) return LineEnd{stop, stop + 2, false};
    return LineEnd{stop, stop + (ending == "\r\r\n" ? 3 : 1), false};
}

Status LineReader::next(std::string_view& line, bool& end) {
    size_t searched = at_;
    // Nearly all lines.
    if (const size_t stop = carriage_returns_ || zeros_ ? std::string::npos : buffer_.find('\n', at_); stop != std::string::npos) {
        line = std::string_view(buffer_).substr(at_, stop - at_);
        at_ = stop + 1;
        end = false;
        ++line_;
        return {};
    }
    while (true) {
        if (const auto found = find_end(searched)) {
            line = std::string_view(buffer_).substr(at_, found->stop - at_);
            at_ = found->next;
            end = found->of_file;
            ++line_;
            if (zeros_ && line.find('\0') != std::string_view::npos) return bad("a zero byte in text; the file is damaged or of another kind");
            return {};
        }
        searched -= at_;
        buffer_.erase(0, at_);
        at_ = 0;
        if (buffer_.size() > longest_line) {
            ++line_;
            return bad("a line is longer than 16 MiB; this is no such text file");
        }
        RAYPAGER_TRY(read_more());
        searched = std::max(searched, at_);
    }
}

Status LineReader::read_more() {
    const size_t had = buffer_.size(), count = static_cast<size_t>(std::min<uint64_t>(read_at_once, file_.size() - offset_));
    // Looked for here, in many lines at once, these cost next to nothing where there are none.
    const auto holds = [this](char c, size_t from, size_t size) {
        return std::string_view(buffer_).substr(from, size).find(c) != std::string_view::npos;
    };
    carriage_returns_ = carriage_returns_ && holds('\r', 0, had);
    zeros_ = zeros_ && holds('\0', 0, had);
    buffer_.resize(had + count);
    RAYPAGER_TRY(file_.read(offset_, std::as_writable_bytes(std::span(buffer_).subspan(had))));
    carriage_returns_ = carriage_returns_ || holds('\r', had, count);
    zeros_ = zeros_ || holds('\0', had, count);
    if (offset_ == 0) RAYPAGER_TRY(skip_mark());
    offset_ += count;
    return {};
}

// A byte order mark at the start of the file.
Status LineReader::skip_mark() {
    if (buffer_.starts_with("\xef\xbb\xbf")) at_ = 3;
    if (!buffer_.starts_with("\xff\xfe") && !buffer_.starts_with("\xfe\xff")) return {};
    ++line_;
    return bad("is text in UTF-16, which cannot be read; save it as UTF-8, for instance with: iconv -f UTF-16 -t UTF-8 FILE > NEW");
}

Status LineReader::bad(const std::string& what) const { return Status::failed(fmt::format("{}:{}: {}", file_.path().string(), line_, what)); }

}  // namespace raypager
