#include "import/bare_meshes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>
#include <unordered_map>

#include "import/cloud_file.hpp"
#include "import/mesh_colors.hpp"
#include "import/obj_materials.hpp"
#include "import/text.hpp"
#include "scene/clean_mesh.hpp"

namespace raypager {
namespace {

constexpr uint64_t most_looked_at = uint64_t{1} << 20;  // triangles of a mesh that need not be read as a whole

uint64_t bytes_of_mesh(const TriangleMesh& mesh) {
    return mesh.positions.size() * sizeof(Float3) * 2 + mesh.uvs.size() * sizeof(Float2) + mesh.triangles.size() * sizeof(Triangle);
}

// What it has is shown, and kept if there is room for it.
Status keep_whole(const MeshFile& file, TriangleMesh mesh, const MeshIssues& issues, uint64_t& keep_bytes, const LookAtMesh& look) {
    MeshSample sample;
    sample.mesh = std::move(mesh);
    RAYPAGER_TRY(look(sample, true, issues));
    const uint64_t bytes = bytes_of_mesh(sample.mesh);
    if (bytes > keep_bytes) return {};
    keep_bytes -= bytes;
    file.keep_for_next_load(std::move(sample.mesh), issues);
    return {};
}

Status add_mesh(const BareMeshFile& file, uint64_t& keep_bytes, const LookAtMesh& look, BareMeshes& out) {
    out.meshes.push_back({file.mesh, file.origin(), std::nullopt, std::nullopt, std::nullopt});
    MeshIssues issues;
    if (file.mesh->declared_triangles() > most_looked_at) {
        const auto sample = sample_mesh(*file.mesh, most_looked_at, issues);
        return sample ? look(*sample, false, issues) : sample.status();
    }
    TriangleMesh mesh;
    RAYPAGER_TRY(file.mesh->load(mesh, issues, false));  // no material of a bare mesh reads textures
    return keep_whole(*file.mesh, std::move(mesh), issues, keep_bytes, look);
}

// Numbers of the materials that some triangle has, in the order of their first.
std::vector<uint32_t> used_materials(const ObjModel& model) {
    std::vector<uint32_t> used;
    std::vector<bool> seen(model.materials.size(), false);
    for (size_t i = 0; i < model.runs.size(); ++i) {
        const uint64_t end = i + 1 < model.runs.size() ? model.runs[i + 1].first : model.mesh.triangles.size();
        if (end == model.runs[i].first || seen[model.runs[i].material]) continue;
        seen[model.runs[i].material] = true;
        used.push_back(model.runs[i].material);
    }
    return used;
}

class ObjLook {
public:
    ObjLook(const BareMeshFile& file, const ObjModel& model, BareMeshes& out)
        : file_(file), names_libraries_(!model.libraries.empty()), libraries_(read_obj_libraries(file.path, model.libraries)), out_(out) {
        out.files.insert(out.files.end(), libraries_.files.begin(), libraries_.files.end());
        out.warnings.insert(out.warnings.end(), libraries_.warnings.begin(), libraries_.warnings.end());
        for (const ObjMaterial& material : libraries_.materials) by_name_.emplace(material.name, &material);
    }

    void add(std::shared_ptr<const MeshSource> source, const std::string& name) {
        BareMesh& mesh = out_.meshes.emplace_back(BareMesh{std::move(source), file_.origin(), std::nullopt, std::nullopt, std::nullopt});
        auto found = by_name_.find(name);
        if (found == by_name_.end()) found = by_name_.find(split_off_comment(name));
        if (found == by_name_.end()) {
            // Libraries that cannot be read have been named.
            if (!name.empty() && (!by_name_.empty() || !names_libraries_)) unknown_.push_back(name);
            return;
        }
        mesh.material = engine_material(*found->second);
        mesh.opacity = cut_out_opacity(*found->second);
        mesh.radiance = emitted_radiance(*found->second);
    }

    void say_unknown() {
        if (unknown_.empty()) return;
        const std::string more = unknown_.size() > 1 ? fmt::format(" and {} more", unknown_.size() - 1) : "";
        out_.warnings.push_back(fmt::format("{}: material \"{}\"{} {} in {}; clay is used", file_.path.string(), unknown_.front(), more,
                                            unknown_.size() > 1 ? "are" : "is",
                                            names_libraries_ ? "none of its libraries" : "no library, since it names none (mtllib)"));
    }

private:
    // "#" may belong to a name; if there is none of that name, it begins a comment.
    static std::string_view split_off_comment(std::string_view name) {
        name = without_comment(name);
        while (!name.empty() && is_blank(name.back())) name.remove_suffix(1);
        return name;
    }

    const BareMeshFile& file_;
    const bool names_libraries_;
    const ObjLibraries libraries_;
    std::unordered_map<std::string_view, const ObjMaterial*> by_name_;  // the first of each name
    BareMeshes& out_;
    std::vector<std::string> unknown_;
};

// One mesh a material.
Status add_model(const BareMeshFile& file, std::shared_ptr<const ObjModel> model, uint64_t& keep_bytes, const LookAtMesh& look, BareMeshes& out) {
    const std::vector<uint32_t> used = used_materials(*model);
    ObjLook materials(file, *model, out);
    MeshIssues issues = model->issues;
    if (used.size() == 1) {
        const auto mesh = MeshFile::open(file.path);
        if (!mesh) return mesh.status();
        materials.add(*mesh, model->materials[used.front()]);
        materials.say_unknown();
        TriangleMesh whole = model->mesh;
        model.reset();
        std::replace(whole.colors.begin(), whole.colors.end(), RP_NONE, no_color);
        clean_mesh(whole, issues);
        return keep_whole(**mesh, std::move(whole), issues, keep_bytes, look);
    }
    for (const uint32_t material : used) materials.add(file.obj->part(*model, material), model->materials[material]);
    materials.say_unknown();
    MeshSample sample;
    sample.mesh = model->mesh;
    clean_mesh(sample.mesh, issues);
    RAYPAGER_TRY(look(sample, true, issues));
    if (model->bytes() > keep_bytes) return {};
    keep_bytes -= model->bytes();
    file.obj->keep_for_parts(model, used.size());
    return {};
}

Status add_obj(const BareMeshFile& file, uint64_t& keep_bytes, const LookAtMesh& look, BareMeshes& out) {
    auto model = file.obj->model();
    if (!model) return model.status();
    return add_model(file, std::move(*model), keep_bytes, look, out);
}

}  // namespace

Result<std::vector<BareMeshFile>> open_mesh_files(const std::vector<std::filesystem::path>& paths) {
    std::vector<BareMeshFile> files;
    for (const auto& path : paths) {
        if (is_cloud_file(path)) continue;
        BareMeshFile& file = files.emplace_back();
        file.path = path;
        if (mesh_format(path) == MeshFormat::obj) {
            const auto obj = ObjFile::open(path);
            if (!obj) return obj.status();
            file.obj = *obj;
        } else {
            const auto mesh = MeshFile::open(path);
            if (!mesh) return mesh.status();
            file.mesh = *mesh;
        }
    }
    return files;
}

Status add_bare_meshes(const BareMeshFile& file, uint64_t& keep_bytes, const LookAtMesh& look, BareMeshes& out) {
    return file.mesh ? add_mesh(file, keep_bytes, look, out) : add_obj(file, keep_bytes, look, out);
}

}  // namespace raypager
