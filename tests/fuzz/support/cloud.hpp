// Reading one file of points, for the targets of their formats.
#pragma once

#include <string>
#include <string_view>

namespace raypager::fuzz {

// Opens and streams a cloud of this ending as the importer does. What it hands on must be sound, and no more than was declared.
void load_cloud(const std::string& ending, std::string_view input);

}  // namespace raypager::fuzz
