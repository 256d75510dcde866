// The lines of a text file, in bounded memory.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "base/files.hpp"

namespace raypager {

class LineReader {
public:
    // Lines are counted from the one that starts at offset, which gets number first_line.
    explicit LineReader(const InputFile& file, uint64_t offset = 0, uint64_t first_line = 1) : file_(file), offset_(offset), line_(first_line - 1) {}
    // The next line without its end, valid until the next call. end is set if there is none. A line of more than 16 MiB is an error, and so
    // is a zero byte.
    Status next(std::string_view& line, bool& end);
    uint64_t line() const { return line_; }                                 // number of the line that next() gave
    uint64_t position() const { return offset_ - (buffer_.size() - at_); }  // in the file, of the line that comes next
    Status bad(const std::string& what) const;                              // file:line: what

private:
    const InputFile& file_;
    uint64_t offset_, line_;
    std::string buffer_;
    size_t at_ = 0;
};

}  // namespace raypager
