// Readers of single mesh files. Each fills an empty mesh with what the file says, polygons cut into fans; clean_mesh() comes after.
// Memory grows in proportion to the file, whatever its header claims. issues counts what a reader dropped itself.
#pragma once

#include "base/files.hpp"
#include "import/ply_header.hpp"
#include "raypager/scene.hpp"

namespace raypager {

enum class MeshFormat { ply, obj, stl, off };

// PLY in either byte order, with any layout of properties; elements other than vertices and faces are skipped.
Status read_ply_binary(const InputFile& file, const PlyHeader& header, TriangleMesh& mesh, MeshIssues& issues);
// The same, piece by piece in little memory, if the file lists vertices before faces.
Status stream_ply_binary(const InputFile& file, const PlyHeader& header, MeshSink& sink, MeshIssues& issues);

// OBJ, STL, OFF and PLY as text, through OpenMesh. May be called from several threads; the work is done one at a time.
// Only there if RAYPAGER_EDGES is defined.
Status read_with_openmesh(const InputFile& file, MeshFormat format, TriangleMesh& mesh, MeshIssues& issues);

// Appends a polygon as a fan of triangles. Fewer than three corners count as degenerate.
class FanBuilder {
public:
    FanBuilder(TriangleMesh& mesh, MeshIssues& issues) : mesh_(mesh), issues_(issues) {}
    void begin() { corners_ = 0; }
    void corner(uint32_t vertex) {
        if (corners_ >= 2) mesh_.triangles.push_back({first_, previous_, vertex});
        if (corners_ == 0) first_ = vertex;
        previous_ = vertex;
        ++corners_;
    }
    void end() {
        if (corners_ < 3) ++issues_.degenerate;
    }

private:
    TriangleMesh& mesh_;
    MeshIssues& issues_;
    uint64_t corners_ = 0;
    uint32_t first_ = 0, previous_ = 0;
};

}  // namespace raypager
