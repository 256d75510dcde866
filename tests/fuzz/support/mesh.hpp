// Reading one mesh file, for the targets of the mesh formats.
#pragma once

#include <string>
#include <string_view>

namespace raypager::fuzz {

// Opens and loads a mesh of this ending as the importer does. What it accepts must be sound, and no larger than the input accounts for.
void load_mesh(const std::string& ending, std::string_view input);

}  // namespace raypager::fuzz
