// What the name of a file says about its format.
#pragma once

#include <filesystem>
#include <string>

namespace raypager {

// The ending, dot included, in small letters; of a packed file (.gz) the one before: ".ply" of "A.PLY" and of "a.ply.gz".
std::string format_ending(const std::filesystem::path& path);

}  // namespace raypager
