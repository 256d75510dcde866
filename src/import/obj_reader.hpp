// Wavefront OBJ: positions, normals, colours, and which triangles have which material.
#pragma once

#include <array>
#include <functional>
#include <span>
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

    // Numbers of the runs that have this material. Known from sort_runs() on, which read_obj() calls.
    std::span<const uint64_t> runs_of(uint32_t material) const;
    void sort_runs();
    uint64_t end_of_run(uint64_t run) const;  // its first triangle that is not in it any more

    uint64_t bytes() const;

private:
    std::vector<uint64_t> runs_by_material_;
};

// Whether coordinates of textures are wanted of a model that names these libraries. Asked when all of it has been read.
using WantsUvs = std::function<bool(const std::vector<std::string>& libraries)>;
// Coordinates are relative to origin. wants_uvs: where there is none, they are not. An error if there are no faces.
Status read_obj(const InputFile& file, const std::array<double, 3>& origin, const WantsUvs& wants_uvs, ObjModel& model);

// The triangles that have this material, with the vertices that they use; those without a colour get `plain`, but where none has a colour, colours
// stay away.
TriangleMesh part_of_obj(const ObjModel& model, uint32_t material, uint32_t plain);

}  // namespace raypager
