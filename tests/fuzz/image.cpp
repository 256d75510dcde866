// Pictures: PFM, and through OpenImageIO EXR and PNG. The first byte of an input says which, the rest is the file.
#include "base/check.hpp"
#include "fuzz/fuzz.hpp"
#include "raypager/picture.hpp"
#include "support/temporary_folder.hpp"

namespace raypager::fuzz {
namespace {

const char* const endings[] = {".pfm", ".exr", ".png"};

}  // namespace

std::vector<std::string> seeds() {
    use_openimageio();
    std::vector<std::string> result;
    for (const uint32_t channels : {3u, 1u}) {
        Image image{5, 4, channels, {}};
        for (uint32_t i = 0; i < 20 * channels; i++) image.values.push_back(static_cast<float>(i) / 20);
        for (char kind = 0; kind < 3; kind++) {
            const std::filesystem::path path = scratch_path(std::string("seed") + endings[static_cast<size_t>(kind)]);
            if (write_image(path, image)) result.push_back(kind + support::read_file(path));
        }
    }
    return result;
}

void run(std::string_view input) {
    if (input.empty()) return;
    use_openimageio();
    const std::string ending = endings[static_cast<uint8_t>(input[0]) % std::size(endings)];
    const auto image = read_image(write_input("input" + ending, input.substr(1)), input[0] & 4);
    if (!image) return RAYPAGER_CHECK(image.status().message().find("input" + ending) != std::string::npos);
    RAYPAGER_CHECK(image->values.size() == uint64_t{image->width} * image->height * image->channels);
    // Deflate packs at most about a thousand to one, and a value becomes a float; other packings of EXR write a piece of one colour as some bytes.
    check_proportion(image->values.capacity() * sizeof(float), input, ending == ".exr" ? 1 << 20 : 32768);
}

}  // namespace raypager::fuzz
