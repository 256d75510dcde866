// How a text cloud is laid out: which of its lines are points, and which of their columns is what.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "import/guess_columns.hpp"
#include "import/point_columns.hpp"
#include "import/text_dialect.hpp"

namespace raypager {

struct TextLayout {
    TextDialect dialect;
    size_t count = 0;          // words of a line
    size_t least = 0;          // fewer will do, and more: what comes behind them is text of any number of words
    uint64_t header_line = 0;  // that is passed over; 0: none
    std::array<size_t, 3> position = {0, 1, 2};
    std::optional<std::array<size_t, 3>> color;
    std::optional<size_t> intensity, classification, radius;
    ColorType color_type = ColorType::number;
    bool geographic = false;  // longitude and latitude, says the header
    std::vector<std::string> warnings;

    bool fits(size_t words) const { return words == count || (least < count && words >= least); }
};

// A comment, or nothing.
bool is_point_comment(std::string_view line);

// named: what the columns are, as the user says; empty: as a line of names before the points says, and where there is none, as the first
// thousand points and some of the others look like. An error names the line and the word.
Result<TextLayout> find_text_layout(const InputFile& file, const PointColumns& named);

}  // namespace raypager
