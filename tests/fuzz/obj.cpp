// Wavefront OBJ files.
#include "fuzz/fuzz.hpp"
#include "fuzz/support/mesh.hpp"
#include "unit/import_files.hpp"

namespace raypager::fuzz {

std::vector<std::string> seeds() {
    return {test::to_obj(test::make_box()),
            "v 0 0 0 1 0 0\nv 2 0 0 1 0.5 0.5 0.5\nv 1 0.5 0 1D0 0 1\nv 1 2 -1.#IND\nv 1 2 0\n#MRGB ffff0000ff00ff00\nusemtl a b\nf 1 2 3 5\nc 1\nl "
            "1 2\nf 5 1\n",
            "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nvn 0 0 1\nvn 1 0 0\nvt 0 0\nmtllib a.mtl\nf 1/1/1 2/1/2 3//1 \\\n -1//-2\n"};
}

void run(std::string_view input) { load_mesh(".obj", input); }

}  // namespace raypager::fuzz
