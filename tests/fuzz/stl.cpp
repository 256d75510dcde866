// STL files, as text and binary.
#include "fuzz/fuzz.hpp"
#include "fuzz/support/mesh.hpp"
#include "unit/import_files.hpp"

namespace raypager::fuzz {

std::vector<std::string> seeds() {
    std::string colored = test::to_stl_binary(test::make_box());
    colored.replace(5, 10, "COLOR=abcd").replace(84 + 48, 2, "\x1f\x04");
    return {
        test::to_stl_text(test::make_box()), test::to_stl_binary(test::make_box()), colored, colored + "x",
        "solid a facet normal 0 0 1 outer loop vertex 0 0 0 vertex 2 0 0 vertex 1 1 0 vertex 0 2 0 end loop end facet end solid\nsolid\nendsolid"};
}

void run(std::string_view input) { load_mesh(".stl", input); }

}  // namespace raypager::fuzz
