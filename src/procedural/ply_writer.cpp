#include "procedural/ply_writer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>

#include "base/check.hpp"

namespace raypager {
namespace {

static_assert(std::endian::native == std::endian::little, "positions are stored as they lie in memory");
static_assert(sizeof(Float3) == 12 && sizeof(Triangle) == 12);

constexpr size_t face_bytes = 1 + sizeof(Triangle);
constexpr size_t at_once = 8192;

}  // namespace

Result<PlyWriter> PlyWriter::create(const std::filesystem::path& path, uint64_t vertex_count, uint64_t triangle_count, bool has_uvs) {
    RAYPAGER_CHECK(vertex_count <= static_cast<uint64_t>(std::numeric_limits<int32_t>::max()));
    auto file = OutputFile::create(path);
    if (!file) return file.status();
    PlyWriter writer;
    writer.file_ = std::move(*file);
    writer.vertices_left_ = writer.vertex_count_ = vertex_count;
    writer.triangles_left_ = writer.triangle_count_ = triangle_count;
    writer.has_uvs_ = has_uvs;
    RAYPAGER_TRY(writer.file_.write(
        fmt::format("ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n{}"
                    "element face {}\nproperty list uchar int vertex_indices\nend_header\n",
                    vertex_count, has_uvs ? "property float u\nproperty float v\n" : "", triangle_count)));
    return writer;
}

Status PlyWriter::add_vertices(std::span<const Float3> positions) {
    RAYPAGER_CHECK(!has_uvs_ && positions.size() <= vertices_left_);
    vertices_left_ -= positions.size();
    return file_.write(std::as_bytes(positions));
}

Status PlyWriter::add_vertices(std::span<const Float3> positions, std::span<const Float2> uvs) {
    RAYPAGER_CHECK(has_uvs_ && positions.size() == uvs.size() && positions.size() <= vertices_left_);
    vertices_left_ -= positions.size();
    struct Vertex {
        Float3 position;
        Float2 uv;
    };
    static_assert(sizeof(Vertex) == 20);
    std::vector<Vertex> vertices;
    for (size_t done = 0; done < positions.size(); done += vertices.size()) {
        vertices.resize(std::min(positions.size() - done, at_once));
        for (size_t i = 0; i < vertices.size(); i++) vertices[i] = {positions[done + i], uvs[done + i]};
        RAYPAGER_TRY(file_.write(std::as_bytes(std::span(vertices))));
    }
    return {};
}

Status PlyWriter::add_triangles(std::span<const Triangle> triangles) {
    RAYPAGER_CHECK(vertices_left_ == 0 && triangles.size() <= triangles_left_);
    triangles_left_ -= triangles.size();
    std::vector<std::byte> bytes;
    while (!triangles.empty()) {
        const auto piece = triangles.first(std::min(triangles.size(), at_once));
        bytes.resize(piece.size() * face_bytes);
        std::byte* to = bytes.data();
        for (const Triangle& triangle : piece) {
            RAYPAGER_CHECK(triangle[0] < vertex_count_ && triangle[1] < vertex_count_ && triangle[2] < vertex_count_);
            *to = std::byte{3};
            std::memcpy(to + 1, triangle.data(), sizeof triangle);
            to += face_bytes;
        }
        RAYPAGER_TRY(file_.write(std::span<const std::byte>(bytes)));
        triangles = triangles.subspan(piece.size());
    }
    return {};
}

Status PlyWriter::commit() {
    RAYPAGER_CHECK(vertices_left_ == 0 && triangles_left_ == 0);
    return file_.commit();
}

}  // namespace raypager
