// Wavefront OBJ: positions, normals, colours, and which triangles have which material.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "base/files.hpp"
#include "raypager/scene.hpp"

namespace raypager {

struct ObjModel {
    struct Run {
        uint64_t first = 0;     // triangle; up to the next run
        uint32_t material = 0;  // number among materials
    };
    TriangleMesh mesh;                   // as the file has it. colors: RP_NONE for a vertex without one; none at all if no vertex has one
    std::vector<Run> runs;               // in ascending order, from triangle 0 on
    std::vector<std::string> materials;  // names, each once; "": triangles before the first usemtl
    std::vector<std::string> libraries;  // what follows "mtllib", one or several file names, which may hold blanks
    MeshIssues issues;

    uint64_t bytes() const;
};

// Coordinates are relative to origin. An error if there are no faces.
Status read_obj(const InputFile& file, const std::array<double, 3>& origin, ObjModel& model);

// The triangles that have this material, with the vertices that they use; those without a colour get `plain`, but where none has a colour, colours
// stay away.
TriangleMesh part_of_obj(const ObjModel& model, uint32_t material, uint32_t plain);

}  // namespace raypager
