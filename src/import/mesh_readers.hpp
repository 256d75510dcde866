// Readers of single mesh files. Each fills an empty mesh with what the file says; clean_mesh() comes after. Memory grows in proportion to the file,
// whatever its header claims. issues: what a reader dropped itself. Any number of threads may read at a time.
#pragma once

#include <array>

#include "base/files.hpp"
#include "import/ply_header.hpp"
#include "raypager/scene.hpp"

namespace raypager {

enum class MeshFormat { ply, obj, stl, off };

class PtexAtlas;

// How the numbers in a file are to be taken.
struct MeshView {
    std::array<double, 3> origin = {0, 0, 0};  // taken off all positions, before these are rounded to single precision
    double color_scale = 1;                    // of the colours of PLY vertices: the number that stands for all of a primary
    bool uvs = true;                           // coordinates of textures are wanted
    // Of PLY: coordinates of textures are those of places on this image, by the number that a face has in the Ptex file, and a corner's place on the
    // face: what it has for u and v, or else the corners of the unit square in their order.
    const PtexAtlas* faces = nullptr;
};

// PLY in either byte order, with any layout of properties; other elements are skipped.
Status read_ply_binary(const InputFile& file, const PlyHeader& header, const MeshView& view, TriangleMesh& mesh, MeshIssues& issues);
// The same, piece by piece in little memory, if PlyLayout::in_pieces().
Status stream_ply_binary(const InputFile& file, const PlyHeader& header, const MeshView& view, MeshSink& sink, MeshIssues& issues);
Status read_ply_text(const InputFile& file, const PlyHeader& header, const MeshView& view, TriangleMesh& mesh, MeshIssues& issues);
Status read_off(const InputFile& file, const MeshView& view, TriangleMesh& mesh, MeshIssues& issues);
Status read_stl(const InputFile& file, const std::array<double, 3>& origin, TriangleMesh& mesh, MeshIssues& issues);

}  // namespace raypager
