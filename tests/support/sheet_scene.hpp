// A scene in files, of any number of triangles, for tests of the program as a whole.
#pragma once

#include <cstdint>

#include "support/temporary_folder.hpp"

namespace raypager::support {

// scene.pbrt, a bumpy sheet under a white sky seen in 12 x 8 pixels, and sheet.ply with its 2 n^2 triangles.
void write_sheet_scene(const TemporaryFolder& folder, uint32_t n);

}  // namespace raypager::support
