// How a render goes about its work. Nothing here changes the picture. "The paper": Sun, Yan, Wu, Kubiatowicz 2014, "GPU Memory Management for
// Efficient Ray Tracing Applications".
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string_view>

#include "raypager/device_profile.hpp"

namespace raypager {

// Which blocks come and go.
enum class PolicyKind {
    aged_wants,       // load: requests x (age of the oldest)^(1/4) / bytes; evict: what the fewest rays enter
    most_wanted,      // the paper, 3.5: load the most requested; evict the least bounced of the last round
    wanted_per_byte,  // load: requests / bytes; evict: least recently used
    lru,              // on demand: load the block requested for longest, at once; evict: least recently used
    sweep             // blind: load every block in turn, whatever is requested; evict: the one that has been there for longest
};

struct PolicyName {
    PolicyKind kind;
    std::string_view name;
};
inline constexpr std::array<PolicyName, 5> policy_names = {{{PolicyKind::aged_wants, "aged-wants"},
                                                            {PolicyKind::most_wanted, "most-wanted"},
                                                            {PolicyKind::wanted_per_byte, "wanted-per-byte"},
                                                            {PolicyKind::lru, "lru"},
                                                            {PolicyKind::sweep, "sweep"}}};

constexpr std::string_view policy_name(PolicyKind kind) {
    for (const PolicyName& entry : policy_names)
        if (entry.kind == kind) return entry.name;
    return "?";
}

constexpr std::optional<PolicyKind> policy_from_name(std::string_view name) {
    for (const PolicyName& entry : policy_names)
        if (entry.name == name) return entry.kind;
    return std::nullopt;
}

// How rays are traced: one per work-item (GPUs), or 64 of them in a stream (CPUs alone). Each needs its own form of the blocks.
enum class Traversal { automatic, ray, stream };

struct TraversalName {
    Traversal traversal;
    std::string_view name;
};
inline constexpr std::array<TraversalName, 3> traversal_names = {
    {{Traversal::automatic, "auto"}, {Traversal::ray, "ray"}, {Traversal::stream, "stream"}}};

constexpr std::optional<Traversal> traversal_from_name(std::string_view name) {
    for (const TraversalName& entry : traversal_names)
        if (entry.name == name) return entry.traversal;
    return std::nullopt;
}

// Where the pool of blocks lies. host is a baseline for measurements, not a mode to render in: geometry in host memory that the device has mapped
// and reads across the bus, without any paging. The pool then holds all blocks and does not count as device memory.
enum class PoolPlace { device, host };

// The defaults are the best known.
struct RenderTuning {
    uint32_t paths = 0;  // path slots; 0: chosen from the limits
    PolicyKind policy = PolicyKind::aged_wants;
    Traversal traversal = Traversal::automatic;
    ProfileChanges profile;                  // of what suits the device
    uint32_t loads_in_flight = 0;            // while blocks must be evicted for them; 0: the default of the policy
    std::optional<double> hold_above_ready;  // no block leaves for another while more than this share of the slots can go on, 0 to 1
    bool wait_for_loads = false;             // every round waits for the loads that were started before it, as in the paper
    uint32_t tile_size = 0;                  // camera paths start in tiles of so many pixels a side, 1 to 1024; 0: what suits the device, 16 mostly
    // So many samples of a pixel are begun one after the other, at most, 1 to 64; 0: up to 16, but 1 if the time decides how many there are, or
    // pictures are looked at before the end, as with snapshots and checkpoints.
    uint32_t together = 0;
    // So many pixels get all their samples before the next ones begin; 0: all of them at once. If not given, long renders whose samples begin
    // together choose it by their path slots.
    std::optional<uint32_t> region;
    PoolPlace pool_place = PoolPlace::device;
};

}  // namespace raypager
