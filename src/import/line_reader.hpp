// The lines of a text file, in bounded memory.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "base/files.hpp"

namespace raypager {

// Lines end in LF, CR LF or CR, even in the same file. A UTF-8 byte order mark at the start of the file is passed over.
class LineReader {
public:
    // Lines are counted from the one that starts at offset, which gets number first_line.
    explicit LineReader(const InputFile& file, uint64_t offset = 0, uint64_t first_line = 1) : file_(file), offset_(offset), line_(first_line - 1) {}
    // The next line without its end, valid until the next call. end is set if there is none. A line of more than 16 MiB is an error, and so
    // are a zero byte and UTF-16.
    Status next(std::string_view& line, bool& end);
    uint64_t line() const { return line_; }                                 // number of the line that next() gave
    uint64_t position() const { return offset_ - (buffer_.size() - at_); }  // in the file, of the line that comes next
    Status bad(const std::string& what) const;                              // file:line: what

private:
    struct LineEnd {
        size_t stop, next;  // in the buffer: where the line ends, and where the next one begins
        bool of_file;       // there is no line any more
    };
    std::optional<LineEnd> find_end(size_t& searched) const;
    Status read_more();
    Status skip_mark();

    const InputFile& file_;
    uint64_t offset_, line_;
    std::string buffer_;
    size_t at_ = 0;
    bool carriage_returns_ = false, zeros_ = false;  // whether the buffer holds any
};

}  // namespace raypager
