#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "raypager/scene.hpp"
#include "scene/clean_mesh.hpp"

namespace raypager {

void MeshIssues::add(const MeshIssues& other) {
    not_finite += other.not_finite;
    bad_index += other.bad_index;
    degenerate += other.degenerate;
    few_corners += other.few_corners;
    crossed += other.crossed;
    duplicate += other.duplicate;
    non_manifold_edges += other.non_manifold_edges;
    bad_uv += other.bad_uv;
    changed_radius += other.changed_radius;
    not_compared += other.not_compared;
    for (const MeshWarning& warning : other.warnings) add_warning(warning);
}

void MeshIssues::add_warning(const MeshWarning& warning) {
    const auto same = std::find_if(warnings.begin(), warnings.end(), [&](const MeshWarning& w) { return w.kind == warning.kind; });
    if (same == warnings.end())
        warnings.push_back(warning);
    else
        same->files += warning.files;
}

bool MeshIssues::any() const {
    return not_finite || bad_index || degenerate || few_corners || crossed || duplicate || non_manifold_edges || not_compared || bad_uv ||
           changed_radius;
}

std::string MeshIssues::describe() const {
    std::string text;
    const auto tell = [&](uint64_t count, const char* one, const char* many) {
        if (count == 0) return;
        if (!text.empty()) text += ", ";
        text += fmt::format("{} {}", count, count == 1 ? one : many);
    };
    tell(not_finite, "triangle with a vertex, or point, that is not finite dropped",
         "triangles with vertices, or points, that are not finite dropped");
    tell(bad_index, "triangle with a vertex that does not exist dropped", "triangles with vertices that do not exist dropped");
    tell(degenerate, "degenerate triangle dropped", "degenerate triangles dropped");
    tell(few_corners, "face with fewer than three corners dropped", "faces with fewer than three corners dropped");
    tell(crossed, "polygon that crosses itself drawn as a fan", "polygons that cross themselves drawn as fans");
    tell(duplicate, "duplicate triangle kept", "duplicate triangles kept");
    tell(bad_uv, "vertex with coordinates of textures that are not finite, or beyond 2^60, which become 0",
         "vertices with coordinates of textures that are not finite, or beyond 2^60, which become 0");
    tell(changed_radius, "point with a radius that cannot be stored (below 0.000016 or above 57344: scale the scene)",
         "points with radii that cannot be stored (below 0.000016 or above 57344: scale the scene)");
    tell(non_manifold_edges, "edge shared by more than two triangles", "edges shared by more than two triangles");
    tell(not_compared, "triangle of a large mesh not checked for duplicates", "triangles of large meshes not checked for duplicates");
    return text;
}

MeshVertices vertices_of(const TriangleMesh& mesh) {
    MeshVertices vertices{mesh.positions, {}, {}};
    if (mesh.normals.size() == mesh.positions.size()) vertices.normals = mesh.normals;
    if (mesh.colors.size() == mesh.positions.size()) vertices.colors = mesh.colors;
    if (mesh.uvs.size() == mesh.positions.size()) vertices.uvs = mesh.uvs;
    return vertices;
}

Status MeshSource::stream(MeshSink& sink, MeshIssues& issues) const {
    TriangleMesh mesh;
    MeshIssues own;
    RAYPAGER_TRY(load(mesh, own));
    own.duplicate = own.non_manifold_edges = 0;
    issues.add(own);
    RAYPAGER_TRY(sink.expect(mesh.positions.size(), mesh.triangles.size()));
    RAYPAGER_TRY(sink.vertices(vertices_of(mesh)));
    return sink.triangles(mesh.triangles);
}

Status MeshInMemory::load(TriangleMesh& mesh, MeshIssues& issues) const {
    mesh = mesh_;
    clean_mesh(mesh, issues);
    return {};
}

Status PointsInMemory::stream(const std::function<Status(std::span<const CloudPoint>)>& take, MeshIssues& issues) const {
    constexpr size_t most = size_t{1} << 17;
    const auto is_finite = [](const CloudPoint& p) {
        return std::isfinite(p.position.x) && std::isfinite(p.position.y) && std::isfinite(p.position.z) && std::isfinite(p.radius);
    };
    for (size_t begin = 0; begin < points_.size();) {
        size_t end = begin;
        while (end < points_.size() && end - begin < most && is_finite(points_[end])) end++;
        if (end > begin) {
            RAYPAGER_TRY(take(std::span(points_).subspan(begin, end - begin)));
        } else {
            issues.not_finite++;
            end++;
        }
        begin = end;
    }
    return {};
}

Status MeshInMemory::stream(MeshSink& sink, MeshIssues&) const {
    RAYPAGER_TRY(sink.expect(mesh_.positions.size(), mesh_.triangles.size()));
    RAYPAGER_TRY(sink.vertices(vertices_of(mesh_)));
    return sink.triangles(mesh_.triangles);
}

}  // namespace raypager
