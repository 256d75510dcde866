// Scene -> blocks and pages: meshes are loaded, all primitives are cut together in world space into blocks, and each block gets its bounding volume
// hierarchy. Each object is cut on its own, in its own space, and so are the instances, as boxes in the world. What does not fit into host_limit goes
// over the disk. Images that programs of materials read are cut into pages, and large skies.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>

#include "raypager/blocks.hpp"
#include "raypager/import.hpp"
#include "raypager/scene.hpp"
#include "raypager/status.hpp"

namespace raypager {

// Bounds of BakeOptions::position_error, in the scene's units: below, grid cells would be denormal numbers; above, larger than any coordinate.
inline constexpr float min_position_error = 1e-20f, max_position_error = 1e12f;

// What to make of points when they are baked.
struct PointOptions {
    float radius = 0;                  // of all points, in the world; 0: as the shapes say
    bool radius_from_spacing = false;  // also where shapes or files give a radius
    float radius_scale = 1;            // of all radii but those given as `radius`
    bool cull_to_camera = false;       // leave out what the scene's camera does not see
    float cull_margin = 0.1f;          // beyond the picture's border, as a share of half the picture's sides
    bool filter_to_image = false;      // keep about one point a pixel of the scene's camera
    PointColumns columns = {};         // of text clouds; for the import, which takes them as the files tell where there are none
};

struct BakeOptions {
    uint64_t block_bytes = 0;     // at most, in stored form; 16 KiB .. 32 MiB; 0: about a thousand blocks, of 128 KiB to 4 MiB
    uint32_t block_entries = 64;  // per block, at most: boxes in the top tree that say where its geometry is; 1 .. 64
    PointOptions points;
    // Vertices of meshes may move by so much along each axis, and by the rounding to floats, onto a grid that all share, so that they take fewer
    // bytes; 0: they stay where they are. min_position_error .. max_position_error
    float position_error = 0;
    // Of skies that are images. The pixels of larger ones than this (8 bytes each) are paged.
    uint64_t resident_sky_bytes = uint64_t{4} << 20;
    // Camera rays and mirrors see such a sky as it is, surfaces that scatter light its largest level of at most so many pixels a side: that of 2048
    // has one for each tenth of a degree.
    uint32_t scattered_sky_size = 2048;
    // Nested instances (Object::instances) are flattened as long as that makes at most this many instances: rays find them sooner. More stay nested.
    uint64_t flatten_limit = uint64_t{1} << 16;
    uint64_t host_limit = 0;                  // bytes of main memory for the work, besides the program itself; 0: half of what there is
    const std::atomic<bool>* stop = nullptr;  // the bake ends soon after it becomes true
    std::function<void(const char* stage, double fraction)> progress;  // may be empty; called from any thread
};

struct BakeSummary {
    uint64_t triangles = 0, spheres = 0, blocks = 0, stored_bytes = 0;  // of blocks
    uint64_t objects = 0, instances = 0;                                // triangles and spheres of objects count once
    uint64_t images = 0, pages = 0, texture_bytes = 0;                  // of textures; bytes of the pages
    uint64_t points_culled = 0, points_merged = 0;
    uint64_t buckets = 0;  // that it was baked in, over the disk; 0: all in memory
    MeshIssues issues;
    double seconds = 0;
    // Bytes, if the bake went over the disk because less memory than usual is free; else 0.
    uint64_t reduced_limit = 0, usual_limit = 0;
};

// The least host_limit for blocks of block_bytes at most; 0: of a size that the limit decides.
uint64_t smallest_bake_limit(uint64_t block_bytes = 0);

// Writes a block file (.rpb). On an error, and after a stop, `output` is as it was before.
Result<BakeSummary> bake(const Scene& scene, const BakeOptions& options, const std::filesystem::path& output);

// The same without a file: the blocks stay in memory. (A scene larger than host_limit still goes over the disk, in the folder for temporary files.)
struct BakedInMemory {
    Blocks blocks;
    BakeSummary summary;
};
Result<BakedInMemory> bake(const Scene& scene, const BakeOptions& options);

// Fingerprint of a scene's geometry (shapes and their places, paths, sizes and times of files with meshes and clouds), of the images that its
// programs read, of its sky if that is paged, and of the options that decide how it is cut. Scenes that differ only in materials and their programs,
// other lights, camera or settings have the same.
Result<uint64_t> bake_fingerprint(const Scene& scene, const BakeOptions& options);
// A block file that was baked from a scene with this fingerprint, with the materials, lights, camera and settings of `scene`: what baking it anew
// would make, to the bit. Nothing if the file has another fingerprint, or its lights cannot be replaced.
Result<std::optional<Blocks>> open_baked(const std::filesystem::path& path, const Scene& scene, uint64_t fingerprint);

}  // namespace raypager
