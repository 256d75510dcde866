// A first look at a mesh file: what its numbers mean, before it is read.
#pragma once

#include "import/mesh_readers.hpp"

namespace raypager {

struct MeshLook {
    MeshView view;
    bool lost_digits = false;         // stored in single precision, so far from the origin that shapes suffer
    uint64_t declared_triangles = 0;  // that binary PLY declares; 0 where only reading tells
    bool in_pieces = false;           // can be handed on while it is read
    bool has_colors = false;          // as far as the header tells
    // Two corners of a box around some vertices from all over the file, relative to the origin; none if there are none.
    std::vector<std::array<double, 3>> corners_of_sample;
};

// An error if the file does not begin as its format says.
Result<MeshLook> look_at_mesh_file(const InputFile& file, MeshFormat format);

}  // namespace raypager
