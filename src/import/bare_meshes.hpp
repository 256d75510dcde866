// The mesh files of a bare scene, and the materials that they bring.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "import/mesh_file.hpp"
#include "import/mesh_sample.hpp"
#include "import/obj_file.hpp"
#include "import/textures.hpp"
#include "scene/vector.hpp"

namespace raypager {

struct BareMesh {
    std::shared_ptr<const MeshSource> source;
    Vector origin = {0, 0, 0};                 // is to be added to its positions
    std::optional<TexturedMaterial> material;  // none: whatever bare meshes have
    std::optional<Texture> opacity;            // of what is cut out of it
    std::optional<Float3> radiance;            // that it emits
};

struct BareMeshFile {
    std::filesystem::path path;
    std::shared_ptr<const MeshFile> mesh;  // or, if null:
    std::shared_ptr<const ObjFile> obj;
    Vector origin() const { return mesh ? mesh->origin() : obj->origin(); }
};

// What has been found in the files, one after the other.
struct BareMeshes {
    std::vector<BareMesh> meshes;
    std::vector<std::string> files;     // that their look depends on
    std::vector<std::string> warnings;  // one line each
};

Result<std::vector<BareMeshFile>> open_mesh_files(const std::vector<std::filesystem::path>& paths);

// Shows `look` the triangles of a file (with its issues), some of them where there are very many, in which case the bounds of all vertices are in the
// sample and each triangle stands for several. Meshes that had to be read for that are kept while they fit into keep_bytes, which gets less by it.
using LookAtMesh = std::function<Status(const MeshSample& sample, bool whole, const MeshIssues& issues)>;
Status add_bare_meshes(const BareMeshFile& file, uint64_t& keep_bytes, const LookAtMesh& look, BareMeshes& out);

}  // namespace raypager
