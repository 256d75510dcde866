#include "import/mesh_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <new>
#include <stdexcept>
#include <utility>

#include "import/checked_input.hpp"
#include "scene/clean_mesh.hpp"

namespace raypager {
namespace {

#ifdef RAYPAGER_EDGES
constexpr bool has_openmesh = true;
#else
constexpr bool has_openmesh = false;
Status read_nothing(const InputFile& file) {
    return Status::failed(file.path().string() +
                          ": this build reads binary PLY only (it was made without OpenMesh: RAYPAGER_EDGES=OFF); convert the mesh to binary PLY");
}
#endif

Status read_other(const InputFile& file, MeshFormat format, TriangleMesh& mesh, MeshIssues& issues) {
#ifdef RAYPAGER_EDGES
    return read_with_openmesh(file, format, mesh, issues);
#else
    (void)format, (void)mesh, (void)issues;
    return read_nothing(file);
#endif
}

// Whether the first bytes make sense; declared_triangles is set where they tell.
Status check_start(const InputFile& file, MeshFormat format, uint64_t& declared_triangles) {
    const std::string name = file.path().string();
    if (file.size() == 0) return Status::failed(name + ": is empty");
    bool needs_openmesh = true;
    if (format == MeshFormat::ply) {
        const auto header = read_ply_header(file);
        if (!header) return header.status();
        const auto layout = find_ply_layout(*header, name);
        if (!layout) return layout.status();
        needs_openmesh = header->encoding == PlyEncoding::ascii;
        if (!needs_openmesh) declared_triangles = layout->faces->count;
    } else if (format == MeshFormat::stl) {
        const auto kind = find_stl_kind(file);
        if (!kind) return kind.status();
    }
    if (!needs_openmesh || has_openmesh) return {};
    TriangleMesh unused;
    MeshIssues none;
    return read_other(file, format, unused, none);
}

Status read_mesh(const InputFile& file, MeshFormat format, TriangleMesh& mesh, MeshIssues& issues) {
    if (format != MeshFormat::ply) return read_other(file, format, mesh, issues);
    const auto header = read_ply_header(file);
    if (!header) return header.status();
    if (header->encoding == PlyEncoding::ascii) return read_other(file, format, mesh, issues);
    return read_ply_binary(file, *header, mesh, issues);
}

}  // namespace

std::optional<MeshFormat> mesh_format(const std::filesystem::path& path) {
    std::string ending = path.extension().string();
    std::transform(ending.begin(), ending.end(), ending.begin(), [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
    if (ending == ".ply") return MeshFormat::ply;
    if (ending == ".obj") return MeshFormat::obj;
    if (ending == ".stl") return MeshFormat::stl;
    if (ending == ".off") return MeshFormat::off;
    return std::nullopt;
}

Result<std::shared_ptr<const MeshFile>> MeshFile::open(const std::filesystem::path& path) {
    const auto format = mesh_format(path);
    if (!format) {
        const bool compressed = path.extension() == ".gz";
        return Status::failed(path.string() +
                              (compressed ? ": is compressed; unpack it with gunzip" : ": is no mesh file; .ply, .obj, .stl and .off can be read"));
    }
    const auto file = InputFile::open(path);
    if (!file) return file.status();
    uint64_t declared_triangles = 0;
    RAYPAGER_TRY(check_start(*file, *format, declared_triangles));
    return std::shared_ptr<const MeshFile>(new MeshFile(path, *format, declared_triangles));
}

Status MeshFile::load(TriangleMesh& mesh, MeshIssues& issues) const {
    if (auto kept = take_kept()) {
        mesh = std::move(kept->mesh);
        issues.add(kept->issues);
        return {};
    }
    mesh = {};
    const auto file = InputFile::open(path_);
    if (!file) return file.status();
    MeshIssues found;
    try {
        RAYPAGER_TRY(read_mesh(*file, format_, mesh, found));
        clean_mesh(mesh, found);
    } catch (const std::bad_alloc&) {
        return Status::failed(fmt::format("{}: not enough memory for its mesh", path_.string()));
    }
    issues.add(found);
    return {};
}

uint64_t MeshFile::bytes_to_read() const {
    std::error_code error;
    const uint64_t bytes = std::filesystem::file_size(path_, error);
    return error ? 0 : bytes;
}

Status MeshFile::stream(MeshSink& sink, MeshIssues& issues) const {
    const auto hand_on = [&sink](const TriangleMesh& mesh) -> Status {
        RAYPAGER_TRY(sink.expect(mesh.positions.size(), mesh.triangles.size()));
        RAYPAGER_TRY(sink.vertices(vertices_of(mesh)));
        return sink.triangles(mesh.triangles);
    };
    if (auto kept = take_kept()) {
        kept->issues.duplicate = kept->issues.non_manifold_edges = 0;
        issues.add(kept->issues);
        return hand_on(kept->mesh);
    }
    const auto file = InputFile::open(path_);
    if (!file) return file.status();
    MeshIssues found;
    try {
        if (format_ == MeshFormat::ply) {
            const auto header = read_ply_header(*file);
            if (!header) return header.status();
            if (header->encoding != PlyEncoding::ascii) {
                const Status status = stream_ply_binary(*file, *header, sink, found);
                issues.add(found);
                return status;
            }
        }
        TriangleMesh mesh;
        RAYPAGER_TRY(read_mesh(*file, format_, mesh, found));
        issues.add(found);
        return hand_on(mesh);
    } catch (const std::bad_alloc&) {
        return Status::failed(fmt::format("{}: not enough memory for its mesh; as binary PLY it could be read in pieces", path_.string()));
    }
}

std::optional<MeshFile::Kept> MeshFile::take_kept() const {
    const std::lock_guard lock(mutex_);
    return std::exchange(kept_, std::nullopt);
}

void MeshFile::keep_for_next_load(TriangleMesh mesh, const MeshIssues& issues) const {
    const std::lock_guard lock(mutex_);
    kept_ = Kept{std::move(mesh), issues};
}

}  // namespace raypager
