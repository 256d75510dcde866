// Sorts primitives on disk into buckets that fit into memory.
#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <vector>

#include "world/bake_memory.hpp"
#include "world/records.hpp"

namespace raypager {

struct DistributeSettings {
    BakeMemory memory;
    std::filesystem::path spill_beside;
    const std::atomic<bool>* stop = nullptr;
    std::function<void(double)> progress;
};

// Splits a bucket (of two primitives at least) into those of a Partition of it, none of them empty; the space of the bucket on disk is given back.
// Nearly always each of them fits into memory; where the sample misled, or there would be too many, they can be split again.
Result<std::vector<Bucket>> distribute(const Bucket& bucket, const DistributeSettings& settings);

// All of a bucket as a world of its own, in order of kind, and within a kind as they came. Triangles have their own vertices. The space on disk is
// given back.
Result<World> load_bucket(const Bucket& bucket);

}  // namespace raypager
