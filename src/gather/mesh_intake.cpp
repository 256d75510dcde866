#include "gather/mesh_intake.hpp"

#include <algorithm>

#include "base/check.hpp"
#include "base/huge_pages.hpp"
#include "block/point_code.hpp"
#include "scene/clean_mesh.hpp"

namespace raypager {

// Besides the mesh itself: what looking for duplicate triangles and edges takes (scene/clean_mesh.cpp).
uint64_t MeshIntake::memory_bytes(uint64_t vertices, uint64_t triangles, const VertexAttributes& attributes) {
    return vertices * ((attributes.normals ? 24 : 12) + (attributes.colors ? 4 : 0) + (attributes.uvs ? 8 : 0) + 8) + triangles * (12 + 12);
}

Result<bool> MeshIntake::stays(uint64_t more_vertices, uint64_t more_triangles) {
    uint64_t vertices = mesh_.positions.size() + more_vertices, triangles = mesh_.triangles.size() + more_triangles;
    // A vector that grows step by step takes up to three times its size on the way.
    if (vertices > mesh_.positions.capacity()) vertices *= 3;
    if (triangles > mesh_.triangles.capacity()) triangles *= 3;
    return hooks_.fits(memory_bytes(std::max(vertices, expected_vertices_), std::max(triangles, expected_triangles_), attributes_));
}

Status MeshIntake::expect(uint64_t vertices, uint64_t triangles) {
    RAYPAGER_CHECK(mesh_.positions.empty() && mesh_.triangles.empty());
    expected_vertices_ = vertices;
    expected_triangles_ = triangles;
    const auto in_memory = hooks_.fits(memory_bytes(vertices, triangles, {.normals = true}));
    if (!in_memory) return in_memory.status();
    if (!*in_memory) return move_to_file();
    reserve_huge(mesh_.positions, vertices);
    reserve_huge(mesh_.triangles, triangles);
    return {};
}

Status MeshIntake::vertices(const MeshVertices& vertices) {
    auto [positions, normals, colors, uvs] = vertices;
    if (!hooks_.colors) colors = {};
    if (!hooks_.uvs) uvs = {};
    RAYPAGER_CHECK(normals.empty() || normals.size() == positions.size());
    RAYPAGER_CHECK(colors.empty() || colors.size() == positions.size());
    RAYPAGER_CHECK(uvs.empty() || uvs.size() == positions.size());
    attributes_.normals |= !normals.empty();
    attributes_.colors |= !colors.empty();
    attributes_.uvs |= !uvs.empty();
    if (!file_) {
        const auto in_memory = stays(positions.size(), 0);
        if (!in_memory) return in_memory.status();
        if (*in_memory) {
            if (!normals.empty()) reserve_huge(mesh_.normals, mesh_.positions.capacity());
            if (!colors.empty()) reserve_huge(mesh_.colors, mesh_.positions.capacity());
            if (!uvs.empty()) reserve_huge(mesh_.uvs, mesh_.positions.capacity());
            mesh_.positions.insert(mesh_.positions.end(), positions.begin(), positions.end());
            mesh_.normals.insert(mesh_.normals.end(), normals.begin(), normals.end());
            mesh_.colors.insert(mesh_.colors.end(), colors.begin(), colors.end());
            mesh_.uvs.insert(mesh_.uvs.end(), uvs.begin(), uvs.end());
            return {};
        }
        RAYPAGER_TRY(move_to_file());
    }
    return append_to_file({positions, normals, colors, uvs});
}

Status MeshIntake::triangles(std::span<const Triangle> indices) {
    if (!file_) {
        const auto in_memory = stays(0, indices.size());
        if (!in_memory) return in_memory.status();
        if (!*in_memory) RAYPAGER_TRY(move_to_file());
    }
    if (!file_) {
        mesh_.triangles.insert(mesh_.triangles.end(), indices.begin(), indices.end());
        return {};
    }
    const uint64_t count = file_->size();
    for (const Triangle& t : indices) {
        if (t[0] >= count || t[1] >= count || t[2] >= count) {
            issues_.bad_index++;
            continue;
        }
        mesh_.triangles.push_back(t);
        if (mesh_.triangles.size() == hooks_.chunk) RAYPAGER_TRY(take_chunk());
    }
    triangles_seen_ += indices.size();
    if (triangles_seen_ <= expected_triangles_) hooks_.progress(static_cast<double>(triangles_seen_) / static_cast<double>(expected_triangles_));
    return {};
}

Status MeshIntake::finish() { return file_ && !mesh_.triangles.empty() ? take_chunk() : Status(); }

Status MeshIntake::move_to_file() {
    auto file = VertexFile::create(hooks_.beside);
    if (!file) return file.status();
    file_ = std::move(*file);
    TriangleMesh mesh = std::move(mesh_);
    mesh_ = {};
    RAYPAGER_TRY(append_to_file(vertices_of(mesh)));
    std::vector<Float3>().swap(mesh.positions);
    mesh_.triangles.reserve(hooks_.chunk);
    return triangles(mesh.triangles);
}

Status MeshIntake::append_to_file(const MeshVertices& vertices) {
    const auto& [positions, normals, colors, uvs] = vertices;
    constexpr size_t piece = size_t{1} << 16;
    std::vector<VertexBits> bits;
    for (size_t first = 0; first < positions.size(); first += piece) {
        bits.resize(std::min(piece, positions.size() - first));
        for (size_t i = 0; i < bits.size(); i++)
            bits[i] = {positions[first + i], normals.empty() ? RP_NONE : placement_.normal(normals[first + i]),
                       colors.empty() ? RP_NONE : point_color_code(colors[first + i]), uvs.empty() ? Float2{} : usable_uv(uvs[first + i], issues_)};
        RAYPAGER_TRY(file_->append(bits, attributes_));
    }
    return {};
}

Status MeshIntake::take_chunk() {
    corners_.resize(3 * mesh_.triangles.size());
    RAYPAGER_TRY(file_->fetch(mesh_.triangles, corners_));
    RAYPAGER_TRY(hooks_.take(mesh_.triangles, corners_, attributes_));
    mesh_.triangles.clear();
    return {};
}

}  // namespace raypager
