// How a file of numbers writes them, and what stands between them.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string_view>

namespace raypager {

struct TextDialect {
    bool decimal_comma = false;   // "1,5;2,5"; otherwise a comma separates numbers
    bool quotes = false;          // "1.5","2.5"
    bool comma_separates = true;  // outside of quotes
    bool plain() const { return !decimal_comma && !quotes; }
};

// Told by looking at lines. The commas of a line are decimal if every one of them stands between digits, no number has two of them, none has a
// point, and something else separates at least three words: "1,5 2,5 3,5", but not "1,5,2" or "1, 2, 3". Where commas stand beside quotes they
// separate, and only those within quotes may be decimal. What nine in ten of the lines with commas have holds for the file.
class DialectFinder {
public:
    void add(std::string_view line);
    TextDialect found() const;

private:
    size_t decimal_ = 0, other_ = 0;  // lines with commas
    bool quotes_ = false, separating_ = false;
};

// As split_numbers() does it, but in a dialect. A word in quotes comes without them, blanks and separators in it included.
size_t split_fields(std::string_view line, const TextDialect& dialect, std::span<std::string_view> words);

// A number as parse_number() takes it, or with a decimal comma if that is the dialect, or with an exponent as Fortran writes it: 1.5D+03.
std::optional<double> parse_field(std::string_view word, const TextDialect& dialect);

}  // namespace raypager
