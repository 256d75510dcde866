#include "cli/output_paths.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <string>

namespace raypager {

std::filesystem::path folder_of(const std::filesystem::path& path) {
    const std::filesystem::path folder = path.parent_path();
    return folder.empty() ? "." : folder;
}

bool folder_is_writable(const std::filesystem::path& folder) { return ::access(folder.c_str(), W_OK | X_OK) == 0; }

Status check_output_path(const std::filesystem::path& path) {
    std::error_code error;
    if (std::filesystem::is_directory(path, error) || !path.has_filename())
        return Status::failed(fmt::format("{}: is a directory; name a file", path.string()));
    const std::filesystem::path folder = folder_of(path);
    if (!std::filesystem::is_directory(folder, error))
        return Status::failed(fmt::format("{}: the folder {} does not exist; make it first", path.string(), folder.string()));
    if (!folder_is_writable(folder)) return Status::failed(fmt::format("{}: the folder {} is not writable", path.string(), folder.string()));
    return {};
}

bool has_ending(const std::filesystem::path& path, std::string_view ending) {
    const std::string extension = path.extension().string();
    return std::ranges::equal(extension, ending, [](unsigned char a, unsigned char b) { return std::tolower(a) == std::tolower(b); });
}

bool same_file(const std::filesystem::path& a, const std::filesystem::path& b) {
    std::error_code error;
    if (std::filesystem::equivalent(a, b, error)) return true;
    // Absent files are told apart by where they would lie.
    const auto place = [&error](const std::filesystem::path& path) {
        return std::filesystem::weakly_canonical(std::filesystem::absolute(path), error);
    };
    const auto place_a = place(a), place_b = place(b);
    return !place_a.empty() && place_a == place_b;
}

}  // namespace raypager
