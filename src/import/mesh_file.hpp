// A mesh in a file of its own.
#pragma once

#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>

#include "import/mesh_look.hpp"
#include "raypager/scene.hpp"

namespace raypager {

// By the ending, in either case and also before .gz; nothing if it is not that of a mesh.
std::optional<MeshFormat> mesh_format(const std::filesystem::path& path);

class MeshFile final : public MeshSource {
public:
    // Checks that the file exists and looks like its ending says; the rest is found out by load().
    static Result<std::shared_ptr<const MeshFile>> open(const std::filesystem::path& path);
    Status load(TriangleMesh& mesh, MeshIssues& issues) const override { return load(mesh, issues, true); }
    // uvs: whether coordinates of textures are wanted.
    Status load(TriangleMesh& mesh, MeshIssues& issues, bool uvs) const;
    // The same mesh, of which the faces have places on the image of a Ptex file. REQUIRES: this is a PLY file.
    std::shared_ptr<const MeshFile> with_faces(std::shared_ptr<const PtexAtlas> faces) const;
    // In pieces from most binary PLY files; of others the whole is read first.
    Status stream(MeshSink& sink, MeshIssues& issues) const override;
    std::string name() const override { return path_.string(); }
    std::vector<std::string> files() const override;
    uint64_t bytes_to_read() const override { return bytes_; }  // once unpacked
    // What the file's header declares; 0 where only reading it tells.
    uint64_t declared_triangles() const { return look_.in_pieces ? look_.declared_triangles : 0; }
    bool has_colors() const { return look_.has_colors; }  // as far as the header tells
    const std::vector<std::array<double, 3>>& corners_of_sample() const { return look_.corners_of_sample; }
    // A position of the file is what load() and stream() give plus this: whole thousands, where coordinates are too large for single precision.
    const std::array<double, 3>& origin() const { return look_.view.origin; }
    // Saves the next load() or stream() from reading the file again: it takes this mesh, as an earlier load() gave it.
    void keep_for_next_load(TriangleMesh mesh, const MeshIssues& issues) const;

private:
    struct Kept {
        TriangleMesh mesh;
        MeshIssues issues;
    };
    std::optional<Kept> take_kept() const;
    MeshFile(std::filesystem::path path, MeshFormat format, const MeshLook& look, uint64_t bytes)
        : path_(std::move(path)), format_(format), look_(look), bytes_(bytes) {}
    void warn(MeshIssues& issues) const;  // of what the first look has found

    std::filesystem::path path_;
    MeshFormat format_;
    MeshLook look_;
    uint64_t bytes_;
    std::shared_ptr<const PtexAtlas> faces_;
    mutable std::mutex mutex_;
    mutable std::optional<Kept> kept_;
};

}  // namespace raypager
