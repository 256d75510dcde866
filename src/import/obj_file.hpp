// An OBJ file as several meshes, one for each of its materials.
#pragma once

#include <filesystem>
#include <memory>
#include <mutex>
#include <vector>

#include "import/mesh_look.hpp"
#include "import/obj_reader.hpp"
#include "raypager/scene.hpp"

namespace raypager {

class ObjFile : public std::enable_shared_from_this<ObjFile> {
public:
    // Checks that the file exists; the rest is found out by model().
    static Result<std::shared_ptr<const ObjFile>> open(const std::filesystem::path& path);

    // What is in the file. It is read once for all who hold it at the same time, whatever their threads.
    Result<std::shared_ptr<const ObjModel>> model() const;
    // Saves reading it again until each part has been loaded once.
    void keep_for_parts(std::shared_ptr<const ObjModel> model, size_t parts) const;

    // The triangles that have this material, by number in the model.
    std::shared_ptr<const MeshSource> part(const ObjModel& model, uint32_t material) const;

    const std::filesystem::path& path() const { return path_; }
    const std::array<double, 3>& origin() const { return look_.view.origin; }

private:
    friend class ObjPart;
    ObjFile(std::filesystem::path path, const MeshLook& look) : path_(std::move(path)), look_(look) {}
    void part_is_loaded(uint32_t material) const;

    std::filesystem::path path_;
    MeshLook look_;
    mutable std::mutex reading_, mutex_;
    mutable std::weak_ptr<const ObjModel> shared_;
    mutable std::shared_ptr<const ObjModel> kept_;
    mutable std::vector<bool> loaded_;  // by material
    mutable size_t left_ = 0;           // parts that have not been
};

}  // namespace raypager
