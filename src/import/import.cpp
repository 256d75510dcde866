#include "import/import.hpp"

#include <algorithm>
#include <new>

#include "import/bare_scene.hpp"
#include "import/cloud_file.hpp"
#include "import/mesh_file.hpp"
#include "import/pbrt_reader.hpp"

namespace raypager {

Result<Scene> import_scene(const std::vector<std::filesystem::path>& inputs, uint64_t keep_bytes, const BareLook& look) {
    if (inputs.empty()) return Status::usage("no input; name a .pbrt scene, meshes (.ply .obj .stl .off) or point clouds (.las .ply .xyz .pts .txt)");
    try {
        const auto pbrt = std::find_if(inputs.begin(), inputs.end(), [](const auto& path) { return path.extension() == ".pbrt"; });
        if (pbrt != inputs.end()) {
            if (inputs.size() > 1) return Status::usage(pbrt->string() + ": a scene stands alone; give either one .pbrt file or meshes and clouds");
            return PbrtReader().read(*pbrt);
        }
        for (const auto& path : inputs)
            if (!mesh_format(path) && !is_cloud_file(path))
                return Status::failed(path.string() + ": of no kind that can be read; .pbrt, .ply, .obj, .stl, .off, .las, .xyz, .pts and .txt can");
        return import_bare(inputs, keep_bytes, look);
    } catch (const std::bad_alloc&) {
        return Status::failed(inputs.front().string() + ": not enough memory to import it");
    } catch (const std::filesystem::filesystem_error& error) {
        return Status::failed(inputs.front().string() + ": " + error.what());
    }
}

}  // namespace raypager
