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

Result<PlyWriter> PlyWriter::create(const std::filesystem::path& path, uint64_t vertex_count, uint64_t triangle_count, bool has_uvs,
                                    bool has_normals) {
    RAYPAGER_CHECK(vertex_count <= static_cast<uint64_t>(std::numeric_limits<int32_t>::max()));
    auto file = OutputFile::create(path);
    if (!file) return file.status();
    PlyWriter writer;
    writer.file_ = std::move(*file);
    writer.vertices_left_ = writer.vertex_count_ = vertex_count;
    writer.triangles_left_ = writer.triangle_count_ = triangle_count;
    writer.has_uvs_ = has_uvs;
    writer.has_normals_ = has_normals;
    RAYPAGER_TRY(writer.file_.write(
        fmt::format("ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n{}{}"
                    "element face {}\nproperty list uchar int vertex_indices\nend_header\n",
                    vertex_count, has_normals ? "property float nx\nproperty float ny\nproperty float nz\n" : "",
                    has_uvs ? "property float u\nproperty float v\n" : "", triangle_count)));
    return writer;
}

Status PlyWriter::add_vertices(std::span<const Float3> positions) {
    RAYPAGER_CHECK(!has_uvs_ && !has_normals_ && positions.size() <= vertices_left_);
    vertices_left_ -= positions.size();
    return file_.write(std::as_bytes(positions));
}

Status PlyWriter::add_vertices(std::span<const Float3> positions, std::span<const Float2> uvs, std::span<const Float3> normals) {
    RAYPAGER_CHECK(has_uvs_ && positions.size() == uvs.size() && positions.size() <= vertices_left_);
    RAYPAGER_CHECK(normals.size() == (has_normals_ ? positions.size() : 0));
    vertices_left_ -= positions.size();
    std::vector<float> values;
    const auto flush = [&] {
        const Status written = file_.write(std::as_bytes(std::span(values)));
        values.clear();
        return written;
    };
    for (size_t i = 0; i < positions.size(); i++) {
        const Float3& p = positions[i];
        values.insert(values.end(), {p.x, p.y, p.z});
        if (has_normals_) values.insert(values.end(), {normals[i].x, normals[i].y, normals[i].z});
        values.insert(values.end(), {uvs[i].x, uvs[i].y});
        if ((i + 1) % at_once == 0) RAYPAGER_TRY(flush());
    }
    return flush();
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
