// A folder of its own for a test, removed with everything in it at the end.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace raypager::support {

class TemporaryFolder {
public:
    // In the system's folder for temporary files; throws if none can be made.
    explicit TemporaryFolder(const std::filesystem::path& parent = std::filesystem::temp_directory_path());
    ~TemporaryFolder();
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;

    const std::filesystem::path& path() const { return path_; }
    std::filesystem::path operator/(std::string_view name) const { return path_ / name; }
    // Writes a file, and returns its path; throws if that fails.
    std::filesystem::path write(std::string_view name, std::string_view content) const;
    // All regular files in it and below, sorted.
    std::vector<std::filesystem::path> files() const;

private:
    std::filesystem::path path_;
};

// What a file holds; empty if it cannot be read.
std::string read_file(const std::filesystem::path& path);

}  // namespace raypager::support
