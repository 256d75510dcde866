#include "import/mesh_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <new>
#include <stdexcept>
#include <utility>

#include "image/ptex_atlas.hpp"
#include "import/endings.hpp"
#include "import/mesh_colors.hpp"
#include "import/obj_reader.hpp"
#include "scene/clean_mesh.hpp"

namespace raypager {
namespace {

Status read_obj_mesh(const InputFile& file, const MeshView& view, TriangleMesh& mesh, MeshIssues& issues) {
    ObjModel model;
    const auto wanted = [](const std::vector<std::string>&) { return true; };
    RAYPAGER_TRY(read_obj(file, view.origin, view.uvs ? WantsUvs(wanted) : WantsUvs(), model));
    mesh = std::move(model.mesh);
    std::replace(mesh.colors.begin(), mesh.colors.end(), RP_NONE, no_color);
    issues.add(model.issues);
    return {};
}

Status read_mesh(const InputFile& file, MeshFormat format, const MeshView& view, TriangleMesh& mesh, MeshIssues& issues) {
    if (format == MeshFormat::obj) return read_obj_mesh(file, view, mesh, issues);
    if (format == MeshFormat::off) return read_off(file, view, mesh, issues);
    if (format == MeshFormat::stl) return read_stl(file, view.origin, mesh, issues);
    const auto header = read_ply_header(file);
    if (!header) return header.status();
    for (const std::string& warning : header->warnings) issues.warn("ply header", warning);
    return header->encoding == PlyEncoding::ascii ? read_ply_text(file, *header, view, mesh, issues)
                                                  : read_ply_binary(file, *header, view, mesh, issues);
}

}  // namespace

std::optional<MeshFormat> mesh_format(const std::filesystem::path& path) {
    const std::string ending = format_ending(path);
    if (ending == ".ply") return MeshFormat::ply;
    if (ending == ".obj") return MeshFormat::obj;
    if (ending == ".stl") return MeshFormat::stl;
    if (ending == ".off") return MeshFormat::off;
    return std::nullopt;
}

Result<std::shared_ptr<const MeshFile>> MeshFile::open(const std::filesystem::path& path) {
    const auto format = mesh_format(path);
    if (!format) return Status::failed(path.string() + ": is no mesh file; .ply, .obj, .stl and .off can be read");
    const auto file = InputFile::open(path);
    if (!file) return file.status();
    const auto look = look_at_mesh_file(*file, *format);
    if (!look) return look.status();
    return std::shared_ptr<const MeshFile>(new MeshFile(path, *format, *look, file->size()));
}

Status MeshFile::load(TriangleMesh& mesh, MeshIssues& issues, bool uvs) const {
    if (auto kept = take_kept()) {
        mesh = std::move(kept->mesh);
        issues.add(kept->issues);
        return {};
    }
    mesh = {};
    const auto file = InputFile::open(path_);
    if (!file) return file.status();
    MeshIssues found;
    MeshView view = look_.view;
    view.uvs = uvs;
    try {
        RAYPAGER_TRY(read_mesh(*file, format_, view, mesh, found));
        clean_mesh(mesh, found);
        warn(found);
    } catch (const std::bad_alloc&) {
        return Status::failed(fmt::format("{}: not enough memory for its mesh", path_.string()));
    }
    issues.add(found);
    return {};
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
    MeshView view = look_.view;
    view.uvs = sink.wants_uvs();
    try {
        if (format_ == MeshFormat::ply) {
            const auto header = read_ply_header(*file);
            if (!header) return header.status();
            if (header->encoding != PlyEncoding::ascii && !faces_) {
                for (const std::string& warning : header->warnings) found.warn("ply header", warning);
                const Status status = stream_ply_binary(*file, *header, view, sink, found);
                warn(found);
                issues.add(found);
                return status;
            }
        }
        TriangleMesh mesh;
        RAYPAGER_TRY(read_mesh(*file, format_, view, mesh, found));
        warn(found);
        issues.add(found);
        return hand_on(mesh);
    } catch (const std::bad_alloc&) {
        return Status::failed(fmt::format("{}: not enough memory for its mesh; as binary PLY it could be read in pieces", path_.string()));
    }
}

std::shared_ptr<const MeshFile> MeshFile::with_faces(std::shared_ptr<const PtexAtlas> faces) const {
    const std::shared_ptr<MeshFile> file(new MeshFile(path_, format_, look_, bytes_));
    file->faces_ = std::move(faces);
    file->look_.view.faces = file->faces_.get();
    return file;
}

std::vector<std::string> MeshFile::files() const {
    std::vector<std::string> files = {path_.string()};
    if (faces_) files.push_back(faces_->name());
    return files;
}

void MeshFile::warn(MeshIssues& issues) const {
    if (look_.lost_digits)
        issues.warn("lost digits",
                    fmt::format("{}: its coordinates are stored in single precision, so far from the origin that their last digits are "
                                "lost already; write it with doubles, or nearer to the origin",
                                path_.string()));
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
