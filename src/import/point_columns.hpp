// What the columns of a text cloud are called.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "raypager/status.hpp"

namespace raypager {

// skip: known to be something that no picture is made of.
enum class PointColumn : uint8_t { skip, x, y, z, intensity, red, green, blue, classification, radius };
using PointColumns = std::vector<PointColumn>;

// What a column of this name holds, in any of the spellings that programs use for it; nothing if the name is not known.
std::optional<PointColumn> find_point_column(std::string_view name);
// Whether the name is that of a longitude or latitude.
bool is_geographic_name(std::string_view name);
// Whether x, y and z are all there.
bool have_position(const PointColumns& columns);
// A list as users write it: "x,y,z,i,r,g,b", with "_" or "-" for what is to be passed over. An error of usage names the word that is wrong.
Result<PointColumns> parse_point_columns(const std::string& list);
// The other way round.
std::string point_column_list(const PointColumns& columns);

}  // namespace raypager
