// Which column of a text cloud is what, where nobody says so.
#pragma once

#include <array>
#include <span>

#include "import/point_columns.hpp"
#include "import/point_readers.hpp"

namespace raypager {

inline constexpr size_t max_columns = 32;  // that are looked at

using ColumnRow = std::array<double, max_columns>;  // the numbers of a line; NAN where there is a word

struct ColumnGuess {
    PointColumns columns;
    ColorType color_type = ColorType::number;
    bool sure = true;  // else others may be as likely
};

// x, y and z come first. Of the others,
// - three neighbours that are unit vectors are normals;
// - three neighbours that are all whole numbers up to 255, or all whole numbers up to 65535 (not bytes among them), or all fractions of 1, are
//   colours, unless one of them has the small numbers that count returns or classes. Of two such sets, the one whose columns go together more
//   (by correlation) is taken: colours do, intensities and labels beside them less. Where that does not tell, of seven columns the last three;
// - what comes directly behind z and is none of these is an intensity.
ColumnGuess guess_columns(std::span<const ColumnRow> rows, size_t count);

}  // namespace raypager
