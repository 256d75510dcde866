// How many primitives a scene shows, each as often as instances place it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "block/baked_scene.hpp"

namespace raypager {

class InstancedCount {
public:
    // REQUIRES: a scene as BlockFile::open accepts it, which outlives this.
    explicit InstancedCount(const BakedScene& scene);
    // Of each block once. stored: its bytes. Objects that do not exist, in a damaged block, are passed over.
    void add(uint32_t block, std::span<const std::byte> stored);
    // Triangles and spheres, those of what lies in instances once for each; 2^64 - 1 stands for more.
    uint64_t primitives() const;

private:
    // Object by object, and of the world at the end.
    struct Owner {
        uint64_t primitives = 0;                 // of its own
        std::map<uint32_t, uint64_t> instances;  // of which object how many
    };
    const BakedScene& scene_;
    std::vector<uint32_t> first_blocks_;  // of each object, and of the world
    std::vector<Owner> owners_;
};

}  // namespace raypager
