#include "import/line_reader.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "import/text.hpp"

namespace raypager {
namespace {

constexpr size_t read_at_once = size_t{64} << 10;
constexpr size_t longest_line = size_t{16} << 20;

}  // namespace

Status LineReader::next(std::string_view& line, bool& end) {
    size_t searched = at_;
    while (true) {
        const size_t newline = buffer_.find('\n', searched);
        if (newline != std::string::npos || offset_ >= file_.size()) {
            const size_t stop = std::min(newline, buffer_.size());
            end = newline == std::string::npos && stop == at_;
            line = trim_line_end(std::string_view(buffer_).substr(at_, stop - at_));
            at_ = std::min(stop + 1, buffer_.size());
            ++line_;
            if (line.find('\0') != std::string_view::npos) return bad("a zero byte in text; the file is damaged or of another kind");
            return {};
        }
        buffer_.erase(0, at_);
        at_ = 0;
        searched = buffer_.size();
        if (searched > longest_line) {
            ++line_;
            return bad("a line is longer than 16 MiB; this is no such text file");
        }
        const size_t count = static_cast<size_t>(std::min<uint64_t>(read_at_once, file_.size() - offset_));
        buffer_.resize(searched + count);
        RAYPAGER_TRY(file_.read(offset_, std::as_writable_bytes(std::span(buffer_).subspan(searched))));
        offset_ += count;
    }
}

Status LineReader::bad(const std::string& what) const { return Status::failed(fmt::format("{}:{}: {}", file_.path().string(), line_, what)); }

}  // namespace raypager
