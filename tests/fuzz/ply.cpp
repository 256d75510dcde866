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
            "element edge 1\nproperty int a\nend_header\n0 0 0 0 0 1 0\n1 0 0 0 0 1 1 5\n1 1 0 0 0 1 0\n0 1 0 0 0 1 2 3 4\n4 0 1 2 3 9\n7\n",
            "ply\rformat ascii 1.0\relement face 1\rproperty list uchar int vertex_index\rproperty list uchar float color\rproperty uchar red\r"
            "property uchar green\rproperty uchar blue\relement tristrips 1\rproperty list int short vertex_indices\relement vertex 4\r"
            "property float x\rproperty float y\rproperty float z\rproperty ushort red\rproperty ushort green\rproperty ushort blue\rend_header\r"
            "4 0 1 2 3 9 1 0 0 0 1 0 0 0 1 1 2 3\r6 0 1 2 -1 3 2\r0 0 0 1 2 3\r2 0 0 1 2 3\r1 0.5 0 1 2 3\r1 2 0 1 2 65535\r"};
}

void run(std::string_view input) { load_mesh(".ply", input); }

}  // namespace raypager::fuzz
