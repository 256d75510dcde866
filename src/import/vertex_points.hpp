// Clouds in formats of meshes: OFF files that declare no faces, and OBJ files whose vertices nothing connects.
#pragma once

#include <memory>

#include "base/files.hpp"
#include "import/point_readers.hpp"

namespace raypager {

// Whether the file has vertices and nothing else to be drawn. What cannot be read is none.
bool is_point_off(const InputFile& file);
bool is_point_obj(const InputFile& file);

// Vertices with their colours, if all have some. REQUIRES: the above.
Result<std::unique_ptr<PointReader>> open_off_points(const InputFile& file);
Result<std::unique_ptr<PointReader>> open_obj_points(const InputFile& file);

}  // namespace raypager
