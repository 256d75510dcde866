#include "view/picture_bytes.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>

#include "base/files.hpp"
#include "base/half.hpp"

namespace raypager {

std::string half_pixels(const Image& image) {
    const size_t pixels = size_t{image.width} * image.height;
    std::string bytes(pixels * 6, '\0');
    auto* out = reinterpret_cast<unsigned char*>(bytes.data());
    for (size_t i = 0; i < pixels; i++)
        for (size_t c = 0; c < 3; c++) {
            const float value = image.values[i * image.channels + c];
            const uint16_t half = std::isnan(value) ? uint16_t{0} : half_of(value);
            *out++ = static_cast<unsigned char>(half & 0xff);
            *out++ = static_cast<unsigned char>(half >> 8);
        }
    return bytes;
}

// Those who write pictures write files.
Result<std::string> file_contents(const Image& image, const std::string& ending) {
    std::error_code error;
    const auto folder = std::filesystem::temp_directory_path(error);
    if (error) return Status::failed(fmt::format("no folder for temporary files: {}; set TMPDIR", error.message()));
    std::string name = (folder / "raypager-view-XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) return Status::failed(fmt::format("{}: no folder can be made there; set TMPDIR", folder.string()));
    const auto path = std::filesystem::path(name) / ("picture" + ending);
    Status written = write_image(path, image);
    Result<std::string> contents = written ? read_text(path) : Result<std::string>(written);
    std::filesystem::remove_all(name, error);
    return contents;
}

}  // namespace raypager
