// Material libraries of OBJ files.
#include <cmath>

#include "base/check.hpp"
#include "fuzz/fuzz.hpp"
#include "import/obj_materials.hpp"
#include "scene/check_material.hpp"

namespace raypager::fuzz {

std::vector<std::string> seeds() {
    return {"newmtl a b\nKd 0.5 0.5 0.5\nKs 1\nKe 1 2 3\nNs 250\nNi 1.5\nd -halo 0.5\nTr 0.5\nillum 4\nPr 0.1\nPm 1\nmap_Kd a.png\n"};
}

void run(std::string_view input) {
    const auto path = write_input("input.mtl", input);
    const ObjLibraries libraries = read_obj_libraries(path.parent_path() / "input.obj", {"input.mtl"});
    // A material takes its keyword and a line end.
    RAYPAGER_CHECK(libraries.materials.size() <= input.size() / 6 && libraries.warnings.size() <= 3);
    for (const ObjMaterial& m : libraries.materials) {
        const rp_material material = engine_material(m).material;
        RAYPAGER_CHECK(check_material(std::span(&material, 1), 0).ok());
        for (const float c : material.color) RAYPAGER_CHECK(c >= 0 && c <= 1);
        RAYPAGER_CHECK(material.alpha >= 0 && material.alpha <= 1 && std::isfinite(material.ior));
        for (const float k : material.k) RAYPAGER_CHECK(std::isfinite(k) && k >= 0);
        if (const auto radiance = emitted_radiance(m)) RAYPAGER_CHECK(std::isfinite(radiance->x + radiance->y + radiance->z));
    }
}

}  // namespace raypager::fuzz
