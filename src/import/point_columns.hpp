// What the columns of a text cloud are called.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "raypager/import.hpp"

namespace raypager {

// What a column of this name holds, in any of the spellings that programs use for it; nothing if the name is not known.
std::optional<PointColumn> find_point_column(std::string_view name);
// Whether the name is that of a longitude or latitude.
bool is_geographic_name(std::string_view name);
// Whether x, y and z are all there.
bool have_position(const PointColumns& columns);

}  // namespace raypager
