#include "support/sheet_scene.hpp"

#include <fmt/format.h>

#include <array>

namespace raypager::support {
namespace {

template <class T>
void append(std::string& to, T value) {
    to.append(reinterpret_cast<const char*>(&value), sizeof value);
}

std::string sheet_ply(uint32_t n) {
    std::string ply = fmt::format(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n"
        "element face {}\nproperty list uchar uint vertex_indices\nend_header\n",
        (n + 1) * (n + 1), 2 * n * n);
    for (uint32_t i = 0; i < (n + 1) * (n + 1); i++)
        for (const float x : {static_cast<float>(i % (n + 1)), static_cast<float>(i * 7 % 5) * 0.1f, static_cast<float>(i / (n + 1))}) append(ply, x);
    for (uint32_t i = 0; i < n * n; i++) {
        const uint32_t a = i / n * (n + 1) + i % n, b = a + n + 1;
        for (const auto& triangle : {std::array{a, b, a + 1}, std::array{a + 1, b, b + 1}}) {
            append(ply, uint8_t{3});
            for (const uint32_t vertex : triangle) append(ply, vertex);
        }
    }
    return ply;
}

}  // namespace

void write_sheet_scene(const TemporaryFolder& folder, uint32_t n) {
    folder.write("sheet.ply", sheet_ply(n));
    folder.write("scene.pbrt", fmt::format("Film \"rgb\" \"integer xresolution\" 12 \"integer yresolution\" 8\n"
                                           "Sampler \"independent\" \"integer pixelsamples\" 1\nIntegrator \"volpath\" \"integer maxdepth\" 2\n"
                                           "LookAt {0} {0} {1}  {0} 0 {0}  0 1 0\nCamera \"perspective\" \"float fov\" 60\nWorldBegin\n"
                                           "LightSource \"infinite\" \"rgb L\" [1 1 1]\nMaterial \"diffuse\" \"rgb reflectance\" [0.5 0.4 0.3]\n"
                                           "Shape \"plymesh\" \"string filename\" \"sheet.ply\"\n",
                                           n * 0.5, n * -0.3));
}

}  // namespace raypager::support
