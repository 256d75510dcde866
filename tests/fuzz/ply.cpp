// PLY files: text, and binary in both byte orders.
#include "fuzz/fuzz.hpp"
#include "fuzz/support/mesh.hpp"
#include "unit/import_files.hpp"

namespace raypager::fuzz {

std::vector<std::string> seeds() {
    const TriangleMesh box = test::make_box();
    return {test::to_ply_text(box), test::to_ply_binary(box), test::to_ply_binary(box, true),
            "ply\nformat ascii 1.0\nelement vertex 4\nproperty double x\nproperty float y\nproperty int z\nproperty float nx\nproperty float ny\n"
            "property float nz\nproperty list uchar short extra\nelement face 1\nproperty list uint ushort vertex_index\nproperty char flag\n"
            "element edge 1\nproperty int a\nend_header\n0 0 0 0 0 1 0\n1 0 0 0 0 1 1 5\n1 1 0 0 0 1 0\n0 1 0 0 0 1 2 3 4\n4 0 1 2 3 9\n7\n"};
}

void run(std::string_view input) { load_mesh(".ply", input); }

}  // namespace raypager::fuzz
