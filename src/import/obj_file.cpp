#include "import/obj_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <new>

#include "import/mesh_colors.hpp"
#include "import/obj_materials.hpp"
#include "import/text.hpp"
#include "scene/clean_mesh.hpp"

namespace raypager {

class ObjPart final : public MeshSource {
public:
    ObjPart(std::shared_ptr<const ObjFile> file, uint32_t material, std::string name, uint64_t bytes)
        : file_(std::move(file)), material_(material), name_(std::move(name)), bytes_(bytes) {}

    Status load(TriangleMesh& mesh, MeshIssues& issues) const override {
        mesh = {};
        const auto model = file_->model();
        if (!model) return model.status();
        try {
            mesh = part_of_obj(**model, material_, no_color);
            MeshIssues found;
            // What was met on the way is said by the part that comes first.
            if (!(*model)->runs.empty() && (*model)->runs.front().material == material_) found = (*model)->issues;
            clean_mesh(mesh, found);
            issues.add(found);
        } catch (const std::bad_alloc&) {
            return Status::failed(fmt::format("{}: not enough memory for its mesh", file_->path().string()));
        }
        file_->part_is_loaded(material_);
        return {};
    }
    std::string name() const override { return name_; }
    std::vector<std::string> files() const override { return {file_->path().string()}; }
    uint64_t bytes_to_read() const override { return bytes_; }

private:
    const std::shared_ptr<const ObjFile> file_;
    const uint32_t material_;
    const std::string name_;
    const uint64_t bytes_;
};

Result<std::shared_ptr<const ObjFile>> ObjFile::open(const std::filesystem::path& path) {
    const auto file = InputFile::open(path);
    if (!file) return file.status();
    const auto look = look_at_mesh_file(*file, MeshFormat::obj);
    if (!look) return look.status();
    return std::shared_ptr<const ObjFile>(new ObjFile(path, *look));
}

Result<std::shared_ptr<const ObjModel>> ObjFile::model() const {
    const std::lock_guard reading(reading_);  // others wait for what one reads
    {
        const std::lock_guard lock(mutex_);
        if (auto model = shared_.lock()) return model;
    }
    const auto file = InputFile::open(path_);
    if (!file) return file.status();
    try {
        auto model = std::make_shared<ObjModel>();
        const auto wants_uvs = [this](const std::vector<std::string>& libraries) {
            const ObjLibraries known = read_obj_libraries(path_, libraries);
            return std::any_of(known.materials.begin(), known.materials.end(), [](const ObjMaterial& material) {
                return material.diffuse_map || material.specular_map || material.roughness_map || material.opacity_map;
            });
        };
        RAYPAGER_TRY(read_obj(*file, look_.view.origin, wants_uvs, *model));
        const std::lock_guard lock(mutex_);
        shared_ = model;
        return std::shared_ptr<const ObjModel>(std::move(model));
    } catch (const std::bad_alloc&) {
        return Status::failed(fmt::format("{}: not enough memory for its mesh; as binary PLY it could be read in pieces", path_.string()));
    }
}

void ObjFile::keep_for_parts(std::shared_ptr<const ObjModel> model, size_t parts) const {
    const std::lock_guard lock(mutex_);
    loaded_.assign(model->materials.size(), false);
    left_ = parts;
    kept_ = std::move(model);
}

void ObjFile::part_is_loaded(uint32_t material) const {
    const std::lock_guard lock(mutex_);
    if (!kept_ || loaded_[material]) return;
    loaded_[material] = true;
    if (--left_ == 0) kept_.reset();
}

std::shared_ptr<const MeshSource> ObjFile::part(const ObjModel& model, uint32_t material) const {
    uint64_t mine = 0;
    for (const uint64_t run : model.runs_of(material)) mine += model.end_of_run(run) - model.runs[run].first;
    std::error_code error;
    const uint64_t bytes = std::filesystem::file_size(path_, error);
    const double share = static_cast<double>(mine) / static_cast<double>(std::max<size_t>(1, model.mesh.triangles.size()));
    const std::string& name = model.materials[material];
    return std::make_shared<ObjPart>(shared_from_this(), material, name.empty() ? path_.string() : path_.string() + " (" + clipped(name) + ")",
                                     error ? 0 : static_cast<uint64_t>(share * static_cast<double>(bytes)));
}

}  // namespace raypager
