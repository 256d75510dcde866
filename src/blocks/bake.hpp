// Scene -> block file: loads the meshes, cuts all primitives together in world space into blocks, builds each block's BVH, packs it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>

#include "blocks/point_cloud.hpp"
#include "raypager/scene.hpp"
#include "raypager/status.hpp"

namespace raypager {

struct BakeOptions {
    uint64_t block_bytes = 0;  // at most, in memory format; 16 KiB .. RP_MAX_BLOCK_BYTES; 0: about a thousand blocks, of 128 KiB to 4 MiB
    uint32_t sub_boxes = 64;   // portals a block, at most; 1 .. RP_MAX_SUB_BOXES
    PointOptions points;
    std::function<void(const char* stage, double fraction)> progress;  // may be empty
};

struct BakeSummary {
    uint64_t triangles = 0, spheres = 0, blocks = 0, stored_bytes = 0;
    uint64_t points_culled = 0, points_merged = 0;
    MeshIssues issues;
    double seconds = 0;
};

// Fingerprint of a scene's inputs (paths, sizes, times of its files) and of the options.
Result<uint64_t> bake_fingerprint(const Scene& scene, const BakeOptions& options);
Result<BakeSummary> bake(const Scene& scene, const BakeOptions& options, const std::filesystem::path& output);

}  // namespace raypager
