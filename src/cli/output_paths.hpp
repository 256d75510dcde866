// Whether results will have a place to go, asked before the work and not after it.
#pragma once

#include <filesystem>
#include <string_view>

#include "raypager/status.hpp"

namespace raypager {

// An error if path is a directory, or its folder is missing or not writable.
Status check_output_path(const std::filesystem::path& path);
bool folder_is_writable(const std::filesystem::path& folder);
// The folder that a path lies in; "." for a bare name.
std::filesystem::path folder_of(const std::filesystem::path& path);
bool has_ending(const std::filesystem::path& path, std::string_view ending);  // ".rpb", in either case
// Whether both name one file, which may be absent still.
bool same_file(const std::filesystem::path& a, const std::filesystem::path& b);

}  // namespace raypager
