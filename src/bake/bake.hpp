// Scene -> block file: loads the meshes, cuts all primitives together in world space into blocks, builds each block's BVH, packs it. What does not
// fit into host_limit goes over the disk: it is streamed into a scratch file, sorted from there into buckets, and these are baked one by one.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>

#include "base/memory.hpp"
#include "clouds/point_cloud.hpp"
#include "raypager/scene.hpp"
#include "raypager/status.hpp"

namespace raypager {

// Far from where cells are no longer normal numbers; no coordinate is larger.
inline constexpr float least_position_error = 1e-20f, largest_position_error = 1e12f;

struct BakeOptions {
    uint64_t block_bytes = 0;  // at most, in memory format; 16 KiB .. RP_MAX_BLOCK_BYTES; 0: about a thousand blocks, of 128 KiB to 4 MiB
    uint32_t sub_boxes = 64;   // portals a block, at most; 1 .. RP_MAX_SUB_BOXES
    PointOptions points;
    // Vertices of meshes may move by so much along each axis, and by the rounding to floats, onto a grid that all share, so that they take fewer
    // bytes; 0: they stay where they are. least_position_error .. largest_position_error
    float position_error = 0;
    uint64_t host_limit = 0;                  // bytes of main memory for the work, besides the program itself; 0: half of what there is
    const std::atomic<bool>* stop = nullptr;  // the bake ends soon after it becomes true
    std::function<void(const char* stage, double fraction)> progress;  // may be empty
};

struct BakeSummary {
    uint64_t triangles = 0, spheres = 0, blocks = 0, stored_bytes = 0;
    uint64_t points_culled = 0, points_merged = 0;
    uint64_t buckets = 0;  // that it was baked in; 0: all in memory
    MeshIssues issues;
    double seconds = 0;
    DefaultLimit reduced_limit;  // if the bake went over the disk because less memory than usual is free
};

// The least host_limit for blocks of block_bytes at most; 0: of a size that the limit decides.
uint64_t smallest_bake_limit(uint64_t block_bytes = 0);

// Fingerprint of a scene's geometry (shapes and their places, paths, sizes and times of files with meshes and clouds) and of the options that decide
// how it is cut. Scenes that differ only in materials, lights, camera or settings have the same: see restyle.hpp.
Result<uint64_t> bake_fingerprint(const Scene& scene, const BakeOptions& options);
Result<BakeSummary> bake(const Scene& scene, const BakeOptions& options, const std::filesystem::path& output);

}  // namespace raypager
