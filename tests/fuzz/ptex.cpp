// Ptex files, read as a whole and as the image of all faces.
#include "base/check.hpp"
#include "fuzz/fuzz.hpp"
#include "image/ptex_atlas.hpp"
#include "support/ptex_writer.hpp"

namespace raypager::fuzz {

std::vector<std::string> seeds() {
    using support::PtexEncoding;
    const std::vector<support::PtexFace> faces = {
        {2, 1}, {3, 3, PtexEncoding::tiled}, {1, 2, PtexEncoding::differences}, {2, 2, PtexEncoding::constant}, {0, 0, PtexEncoding::constant, true}};
    const auto value = [](uint32_t f, uint32_t x, uint32_t y, uint32_t c) { return f * 31 + x * 7 + y * 3 + c; };
    return {support::PtexWriter::write({0, 3}, faces, value), support::PtexWriter::write({1, 1}, faces, value),
            support::PtexWriter::write({2, 4, 3}, faces, value), support::PtexWriter::write({3, 2}, faces, value)};
}

void run(std::string_view input) {
    const auto file = PtexFile::open(write_input("input.ptx", input));
    if (!file) return RAYPAGER_CHECK(file.status().message().find("input.ptx") != std::string::npos);
    const auto atlas = PtexAtlas::create(*file, {ImageEncoding::Kind::linear, 1});
    if (!atlas) return RAYPAGER_CHECK(atlas.status().message().find("input.ptx") != std::string::npos);
    constexpr uint64_t enough = uint64_t{64} << 20;  // what is packed well may be large
    uint64_t bytes = 0;
    const Status status = (*atlas)->read([&](std::span<const std::byte> rows) {
        bytes += rows.size();
        return bytes > enough ? Status::failed("input.ptx is large") : Status();
    });
    if (!status) RAYPAGER_CHECK(status.message().find("input.ptx") != std::string::npos);
}

}  // namespace raypager::fuzz
