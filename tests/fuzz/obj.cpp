// Wavefront OBJ files.
#include "fuzz/fuzz.hpp"
#include "fuzz/support/mesh.hpp"
#include "unit/import_files.hpp"

namespace raypager::fuzz {

std::vector<std::string> seeds() {
    return {test::to_obj(test::make_box()),
            "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nvn 0 0 1\nvn 1 0 0\nvt 0 0\nmtllib a.mtl\nf 1/1/1 2/1/2 3//1 \\\n -1//-2\n"};
}

void run(std::string_view input) { load_mesh(".obj", input); }

}  // namespace raypager::fuzz
