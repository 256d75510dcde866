// Images of textures: portable maps, and through OpenImageIO EXR and PNG. The first byte of an input says which and how, the rest is the file.
#include "base/check.hpp"
#include "fuzz/fuzz.hpp"
#include "raypager/image_source.hpp"
#include "raypager/picture.hpp"
#include "support/temporary_folder.hpp"

namespace raypager::fuzz {
namespace {

const char* const endings[] = {".ppm", ".pfm", ".exr", ".png"};
constexpr ImageEncoding encodings[] = {{}, {ImageEncoding::Kind::linear, 1}, {ImageEncoding::Kind::srgb, 1}, {ImageEncoding::Kind::gamma, 2.4f}};

}  // namespace

std::vector<std::string> seeds() {
    use_openimageio();
    std::vector<std::string> result = {std::string("\0P5 3 2 255\nabcdef", 18), std::string("\0P6 # c\n1 2 255\nabcdef", 23),
                                       std::string("\4P5 3 1 65535\nabcdef", 20), std::string("\14P6 1 1 1000\nabcdef", 19)};
    Image image{5, 4, 3, std::vector<float>(60, 0.5f)};
    for (char kind = 1; kind < 4; kind++) {
        const std::filesystem::path path = scratch_path(std::string("seed") + endings[static_cast<size_t>(kind)]);
        if (write_image(path, image)) result.push_back(kind + support::read_file(path));
    }
    return result;
}

void run(std::string_view input) {
    if (input.empty()) return;
    use_openimageio();
    const auto first = static_cast<uint8_t>(input[0]);
    const std::string name = std::string("input") + endings[first % 4];
    const auto source = image_file_source(write_input(name, input.substr(1)), encodings[first / 4 % 4]);
    const auto shape = source->shape();
    if (!shape) return RAYPAGER_CHECK(shape.status().message().find(name) != std::string::npos);
    const uint64_t row = uint64_t{shape->width} * shape->channels * bytes_of_channel(shape->kind);
    constexpr uint64_t enough = uint64_t{64} << 20;  // what is packed well may be large
    uint64_t bytes = 0;
    const Status status = source->read([&](std::span<const std::byte> rows) {
        RAYPAGER_CHECK(rows.size() % row == 0);
        bytes += rows.size();
        return bytes > enough ? Status::failed(name + " is large") : Status();
    });
    if (!status) return RAYPAGER_CHECK(status.message().find(name) != std::string::npos);
    RAYPAGER_CHECK(bytes == row * shape->height);
}

}  // namespace raypager::fuzz
