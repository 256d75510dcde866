// A mesh in a file of its own.
#pragma once

#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>

#include "import/mesh_readers.hpp"
#include "raypager/scene.hpp"

namespace raypager {

// By the ending, in either case and also before .gz; nothing if it is not that of a mesh.
std::optional<MeshFormat> mesh_format(const std::filesystem::path& path);

class MeshFile final : public MeshSource {
public:
    // Checks that the file exists, looks like its ending says, and can be read in this build; the rest is found out by load().
    static Result<std::shared_ptr<const MeshFile>> open(const std::filesystem::path& path);
    Status load(TriangleMesh& mesh, MeshIssues& issues) const override;
    // In pieces from binary PLY; from other formats the whole is read first.
    Status stream(MeshSink& sink, MeshIssues& issues) const override;
    std::string name() const override { return path_.string(); }
    std::vector<std::string> files() const override { return {path_.string()}; }
    uint64_t bytes_to_read() const override { return bytes_; }  // once unpacked
    // What the file's header declares; 0 where only reading it tells.
    uint64_t declared_triangles() const { return declared_triangles_; }
    // Saves the next load() or stream() from reading the file again: it takes this mesh, as an earlier load() gave it.
    void keep_for_next_load(TriangleMesh mesh, const MeshIssues& issues) const;

private:
    struct Kept {
        TriangleMesh mesh;
        MeshIssues issues;
    };
    std::optional<Kept> take_kept() const;
    MeshFile(std::filesystem::path path, MeshFormat format, uint64_t declared_triangles, uint64_t bytes)
        : path_(std::move(path)), format_(format), declared_triangles_(declared_triangles), bytes_(bytes) {}

    std::filesystem::path path_;
    MeshFormat format_;
    uint64_t declared_triangles_, bytes_;
    mutable std::mutex mutex_;
    mutable std::optional<Kept> kept_;
};

}  // namespace raypager
