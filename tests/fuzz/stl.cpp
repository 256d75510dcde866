// STL files, as text and binary.
#include "fuzz/fuzz.hpp"
#include "fuzz/support/mesh.hpp"
#include "unit/import_files.hpp"

namespace raypager::fuzz {

std::vector<std::string> seeds() { return {test::to_stl_text(test::make_box()), test::to_stl_binary(test::make_box())}; }

void run(std::string_view input) { load_mesh(".stl", input); }

}  // namespace raypager::fuzz
