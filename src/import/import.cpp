#include "raypager/import.hpp"

#include <algorithm>
#include <map>
#include <new>
#include <utility>

#include "import/bare_scene.hpp"
#include "import/cloud_file.hpp"
#include "import/endings.hpp"
#include "import/gltf_scene.hpp"
#include "import/mesh_file.hpp"
#include "import/pbrt_reader.hpp"
#include "import/precision.hpp"

namespace raypager {
namespace {

std::map<std::string, SceneReader>& other_readers() {
    static std::map<std::string, SceneReader> readers;
    return readers;
}

bool is_scene_ending(const std::string& ending) {
    return ending == ".pbrt" || ending == ".gltf" || ending == ".glb" || other_readers().contains(ending);
}

bool is_usd(const std::string& ending) { return ending == ".usd" || ending == ".usda" || ending == ".usdc" || ending == ".usdz"; }

Status cannot_be_read(const std::filesystem::path& path) {
    if (is_usd(format_ending(path)))
        return Status::failed(path.string() +
                              ": USD cannot be read here; Python reads it: python -m raypager render FILE (pip install 'raypager[usd]')");
    return Status::failed(
        path.string() +
        ": of no kind that can be read; .pbrt, .gltf, .glb, .ply, .obj, .stl, .off, .las, .xyz, .pts, .txt, .asc and .csv can, .laz, "
        ".e57, ept.json and .usd by way of Python: python -m raypager");
}

Result<Scene> with_precision_checked(Result<Scene> scene) {
    if (scene) warn_of_precision(*scene);
    return scene;
}

}  // namespace

void use_scene_reader(const std::string& ending, SceneReader reader) {
    if (reader)
        other_readers()[ending] = std::move(reader);
    else
        other_readers().erase(ending);
}

Result<Scene> import_scene(const std::vector<std::filesystem::path>& inputs, const ImportOptions& options) {
    if (inputs.empty())
        return Status::usage(
            "no input; name a .pbrt, .gltf or .glb scene, meshes (.ply .obj .stl .off) or point clouds (.las .ply .xyz .pts .txt .asc .csv)");
    try {
        const auto scene = std::find_if(inputs.begin(), inputs.end(), [](const auto& path) { return is_scene_ending(format_ending(path)); });
        if (scene != inputs.end()) {
            if (inputs.size() > 1) return Status::usage(scene->string() + ": a scene stands alone; give either one scene file or meshes and clouds");
            if (const auto other = other_readers().find(format_ending(*scene)); other != other_readers().end())
                return with_precision_checked(other->second(*scene, options));
            if (format_ending(*scene) != ".pbrt") return with_precision_checked(import_gltf(*scene, options.look));
            return with_precision_checked(PbrtReader(options.columns).read(*scene));
        }
        for (const auto& path : inputs)
            if (!mesh_format(path) && !is_cloud_file(path)) return cannot_be_read(path);
        return with_precision_checked(import_bare(inputs, options));
    } catch (const std::bad_alloc&) {
        return Status::failed(inputs.front().string() + ": not enough memory to import it");
    } catch (const std::filesystem::filesystem_error& error) {
        return Status::failed(inputs.front().string() + ": " + error.what());
    }
}

}  // namespace raypager
