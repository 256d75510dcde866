// What a render asked of the paging: for a share of its paths, every ray with the blocks that it enters, in its order. That sequence does
// not depend on limits, policies or timing (it follows from ray and top tree alone), so that a recorded one can be served under any other
// pool and policy. Which ray waits when, and so the requests, follow from the policy: they are not recorded but found again by the replay.
// TRACE.md says how the file is laid out.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "raypager/status.hpp"
#include "residency/policy.hpp"

namespace raypager {

// The render that was recorded, for the replay's defaults and for checking the replay against it.
struct RecordedRender {
    std::string device;
    PolicySettings policy;  // as it was in effect
    uint64_t pool_bytes = 0;
    uint64_t slab_bytes = 0;  // of the largest slab
    uint32_t slots = 0;
    bool wait_for_loads = false;
    uint32_t cpu_cores = 1;         // 0: a GPU; defaults follow from it
    uint32_t rounds_under_way = 1;  // at most
    uint64_t paths = 0, rays = 0;   // all of the render, not only those in the trace
    uint64_t loads = 0, bytes_loaded = 0, rounds = 0;
    double seconds = 0, trace_seconds = 0;  // of rendering; of these, of the kernels
    uint64_t scene_identity = 0;            // BakedScene::identity()
};

struct TracedRay {
    uint64_t first_visit = 0;
    uint32_t visits = 0;
    bool shadow = false;
    uint32_t hit_block = 0;  // extension rays: where the closest hit is; RP_NONE: none
};

// One block on a ray's way. Extension rays enter each of them, in this order; shadow rays up to the first that stops them.
struct Visit {
    uint32_t word = 0;
    uint32_t block() const { return word & 0x7fffffffu; }
    bool stops() const { return word >> 31; }
    static Visit of(uint32_t block, bool stops) { return {block | (stops ? 0x80000000u : 0u)}; }
};

struct DemandTrace {
    RecordedRender recorded;
    std::vector<uint32_t> block_bytes;  // in device memory
    // Paths in the order in which they start. Path p has the rays path_rays[p] .. path_rays[p + 1] - 1, one after the other.
    std::vector<uint64_t> path_rays = {0};
    std::vector<TracedRay> rays;
    std::vector<Visit> visits;

    size_t path_count() const { return path_rays.size() - 1; }
    // Of the render's paths, how many are in the trace.
    double share() const { return recorded.paths ? static_cast<double>(path_count()) / static_cast<double>(recorded.paths) : 0; }
    uint64_t geometry_bytes() const;
    uint32_t largest_block() const;
    std::span<const Visit> visits_of(const TracedRay& ray) const { return std::span(visits).subspan(ray.first_visit, ray.visits); }
};

// Written under a temporary name and renamed; damaged files are refused with what is wrong and where.
Status write_demand_trace(const std::filesystem::path& path, const DemandTrace& trace);
Result<DemandTrace> read_demand_trace(const std::filesystem::path& path);

}  // namespace raypager
