// Reads the meshes of a scene ahead of the one who places them, on all cores.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "base/parallel.hpp"
#include "raypager/scene.hpp"

namespace raypager {

// How many of the workers read a mesh while others are being read or will be: its share of all the bytes, and one at least. So all of them have
// something to do, and each mesh has about the threads that there are for it.
size_t workers_for_mesh(size_t workers, uint64_t bytes, uint64_t other_bytes);

class MeshPrefetch {
public:
    struct Loaded {
        TriangleMesh mesh;  // cleaned (scene/clean_mesh.hpp)
        MeshIssues issues;
        Status status;
    };

    // bytes: for all meshes that wait, as MeshIntake::memory_bytes counts them; a mesh that would need too large a share is left out.
    MeshPrefetch(const Scene& scene, uint64_t bytes, const std::atomic<bool>* stop);
    ~MeshPrefetch();
    MeshPrefetch(const MeshPrefetch&) = delete;
    MeshPrefetch& operator=(const MeshPrefetch&) = delete;
    // Waits for the mesh of a shape; nothing if it is too large. REQUIRES: each shape that has a mesh is asked for once, in order.
    std::optional<Loaded> take(size_t shape);

private:
    void work();
    std::optional<Loaded> load(const Shape& shape, size_t workers) const;

    struct Slot {
        size_t shape = 0;
        bool done = false;
        std::optional<Loaded> loaded;
    };
    const Scene& scene_;
    const std::atomic<bool>* const stop_;
    const size_t workers_ = helping_workers();
    uint64_t bytes_each_ = 0;

    std::mutex mutex_;  // of all that follows
    std::condition_variable changed_;
    std::vector<Slot> slots_;      // a ring: the n-th mesh is in slot n modulo their number
    std::vector<size_t> order_;    // shapes that have a mesh
    std::vector<uint64_t> left_;   // bytes to read from the n-th mesh on, to the last
    size_t next_ = 0, taken_ = 0;  // meshes that were begun, and that were taken
    uint64_t under_way_ = 0;       // bytes of the meshes that are being read
    bool ends_ = false;
    std::vector<std::jthread> threads_;
};

}  // namespace raypager
