// OFF files.
#include "fuzz/fuzz.hpp"
#include "fuzz/support/mesh.hpp"
#include "unit/import_files.hpp"

namespace raypager::fuzz {

std::vector<std::string> seeds() {
    return {test::to_off(test::make_box()), "NOFF 4 1 0 # a comment\n0 0 0 0 0 1\n1 0 0 0 0 1\n1 1 0 0 0 1\n0 1 0 0 0 1\n4 0 1 2 3 0.5 0.5 0.5\n",
            "COFF4 2\n0 0 0 255 0 0 1\n2 0 0 0 255 0 1\n1 0.5 0 0 0 255 1\n0 2 0 9 9 9 1\n4 0 1\n2 3 7\n3 0 1 2 255 0 0\n",
            "OFF 3 2 0 0 0 0 1 0 0 0 1 0 3 0 1 2 3\n2 1 0"};
}

void run(std::string_view input) { load_mesh(".off", input); }

}  // namespace raypager::fuzz
