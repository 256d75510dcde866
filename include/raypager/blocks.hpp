// A baked scene: the blocks that its geometry was cut into, and all else that a render needs.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <utility>

#include "raypager/scene.hpp"
#include "raypager/status.hpp"

namespace raypager {

// How blocks lie in a device's memory: as they are stored, with two children per node (GPUs), or wide, with eight (CPUs).
enum class BlockForm { stored, wide };

class BlockSource;
class Peers;

// Blocks in a file or in memory. A handle: copies share what they refer to, which any number of threads may read.
class Blocks {
public:
    // Reads and checks everything in a block file (.rpb) but the blocks, which renders read and check when they need them. The file stays open.
    static Result<Blocks> open(const std::filesystem::path& path);
    // The same scene in all processes that render together. By all together; own: rank 0's. Others may read blocks from the file that rank 0 has
    // opened, where it is there for them under the same path; else from the memory of those that do (RenderOptions::peers).
    static Result<Blocks> hand_out(const std::optional<Blocks>& own, Peers& peers);
    // For the engine: BlockSource is no part of the library.
    explicit Blocks(std::shared_ptr<const BlockSource> source) : source_(std::move(source)) {}

    // The scene's own view and settings, where a render says nothing else.
    const Camera& camera() const;
    uint32_t width() const;      // pixels
    uint32_t height() const;     // pixels
    uint32_t spp() const;        // samples per pixel
    uint32_t max_depth() const;  // scattering events of a path
    // Bounds of all geometry but backdrops, in world space; zeros for an empty scene.
    std::array<float, 3> lower() const, upper() const;

    uint64_t triangles() const;
    uint64_t spheres() const;        // and points
    uint32_t count() const;          // of blocks
    uint64_t block_entries() const;  // boxes in the top tree that say where the geometry of blocks is
    // Bytes of all blocks, and of the largest one, in device memory; 0 without blocks.
    uint64_t bytes(BlockForm form) const;
    uint64_t largest(BlockForm form) const;
    // Images that textures read, and their pages, which are paged as blocks are.
    uint32_t images() const;
    uint32_t pages() const;
    uint64_t texture_bytes() const;               // of all pages, in the file and in device memory
    uint64_t memory_bytes(BlockForm form) const;  // of blocks and pages
    uint64_t instances() const;
    uint32_t materials() const;
    // The blocks before this one are those of objects, each in the space of its object.
    uint32_t first_block_in_world() const;
    // Bounds of a block, in world space, or that of its object. REQUIRES: block < count().
    std::pair<std::array<float, 3>, std::array<float, 3>> bounds(uint32_t block) const;

    const BlockSource& source() const { return *source_; }  // for the engine

private:
    std::shared_ptr<const BlockSource> source_;
};

}  // namespace raypager
