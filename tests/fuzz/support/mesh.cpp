#include "fuzz/support/mesh.hpp"

#include <cmath>

#include "base/check.hpp"
#include "fuzz/fuzz.hpp"
#include "import/mesh_file.hpp"

namespace raypager::fuzz {
namespace {

void check_sound(const TriangleMesh& mesh) {
    RAYPAGER_CHECK(mesh.normals.empty() || mesh.normals.size() == mesh.positions.size());
    RAYPAGER_CHECK(mesh.colors.empty() || mesh.colors.size() == mesh.positions.size());
    RAYPAGER_CHECK(mesh.uvs.empty() || mesh.uvs.size() == mesh.positions.size());
    for (const Float2& uv : mesh.uvs) RAYPAGER_CHECK(std::isfinite(uv.x) && std::isfinite(uv.y));
    for (const uint32_t color : mesh.colors) RAYPAGER_CHECK(color <= 0xffffffu);
    for (const Triangle& triangle : mesh.triangles)
        for (const uint32_t vertex : triangle) {
            RAYPAGER_CHECK(vertex < mesh.positions.size());
            const Float3& p = mesh.positions[vertex];
            RAYPAGER_CHECK(std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z));
        }
    for (const Float3& n : mesh.normals) RAYPAGER_CHECK(std::isfinite(n.x) && std::isfinite(n.y) && std::isfinite(n.z));
}

}  // namespace

void load_mesh(const std::string& ending, std::string_view input) {
    const std::filesystem::path path = write_input("input" + ending, input);
    const auto file = MeshFile::open(path);
    if (!file) return RAYPAGER_CHECK(file.status().message().find("input" + ending) != std::string::npos);
    TriangleMesh mesh;
    MeshIssues issues;
    const Status loaded = (*file)->load(mesh, issues);
    if (!loaded) return RAYPAGER_CHECK(loaded.message().find("input" + ending) != std::string::npos);
    check_sound(mesh);
    // A vertex takes at least three bytes and a triangle one (of a fan with indices of one byte).
    check_proportion((mesh.positions.capacity() + mesh.normals.capacity()) * sizeof(Float3) + mesh.uvs.capacity() * sizeof(Float2) +
                         mesh.triangles.capacity() * sizeof(Triangle),
                     input, 32);
}

}  // namespace raypager::fuzz
