// A simulation of a cluster that renders one picture: nodes with a device each, the store sharded over their memory, links between them. It is fed
// with a recorded demand trace.
//
// What is exact, as in bench/replay.hpp: which blocks rays enter and where they wait, every decision of the policy, what is in the pool and in the
// host cache of each node. Samples are handed out from one counter in shares that shrink (render/sample_pool.hpp).
//
// What is a model: time. A round takes as long as its visits cost on the device, and a fixed time beside. Loads overlap with it; a node without a ray
// that can go on waits for the next of them. A block comes from the host cache; else from the node's own shard, in no time; else from its owner,
// behind all that the owner sends and all that the node receives (each direction a queue with a bandwidth, the first bytes after a latency); else
// from the node's disk. Then it goes over the bus to the device, behind those before it. Links know of no other traffic, and the network between them
// is never full. Memory and processors of the hosts are fast enough: that a block is copied and verified takes no time. Shards are full before the
// clock starts. Films are added up at the end, over a tree. A node that has no more samples serves others still, and that costs it nothing.
//
// A trace of few paths stands for a render of many: each path is traced `repeats` times, by whichever nodes take it, and nodes have as large a share
// of their path slots. Bytes, loads and rounds come out as those of the whole render, as long as a node has more slots then than blocks.
#pragma once

#include <atomic>
#include <cstdint>
#include <string_view>

#include "bench/replay.hpp"
#include "raypager/cluster_forecast.hpp"

namespace raypager::bench {

struct ClusterSettings {
    ReplaySettings node;        // of each: its device; slots: of the render
    uint32_t nodes = 1;         // REQUIRES: 1 to max_cluster_nodes
    uint64_t render_paths = 0;  // of the picture; 0: of the recorded one, times repeats
    uint64_t repeats = 1;       // at least 1
    uint64_t together = 0;      // so many paths of the trace in a row are repeated before the next; 0: all
    uint64_t host_bytes = 0;
    double link = 12.5e9;                     // bytes a second, in each direction; 0: no limit
    double latency = 20e-6;                   // seconds between a request and the first byte that the owner could send
    double disk = 3e9;                        // bytes a second of a node's disk; 0: no limit
    uint64_t film_bytes = 0;                  // of one node
    const std::atomic<bool>* stop = nullptr;  // set from outside: the simulation ends soon, and its figures are worth nothing

    double share_of(const DemandTrace& trace) const;  // of the render's paths, how many are replayed
};

// What limits a run.
enum class ClusterBound { device, bus, link_in, link_out, disk, film, waiting };
std::string_view bound_name(ClusterBound bound);

// Of the whole render; bytes and loads of all nodes together.
struct ClusterResult {
    double seconds = 0;
    double tracing = 0;       // of the mean node: its device is busy
    double film_seconds = 0;  // of seconds, at the end
    // Of the busiest node, each.
    double bus = 0, link_in = 0, link_out = 0, disk = 0;
    uint64_t loads = 0, bytes_loaded = 0;  // onto devices
    uint64_t from_cache = 0, from_own_shard = 0, from_disk = 0, received = 0, sent = 0;
    uint64_t most_received = 0, most_sent = 0;  // by one node
    uint64_t rays = 0, rounds = 0;              // the latter: of the node with the most
    // In memory: of the largest shard; of all shards; in the mean cache at the end.
    uint64_t shard_bytes = 0, store_in_memory = 0, cached_bytes = 0;

    ClusterBound bound() const;
};

ClusterResult simulate_cluster(const DemandTrace& trace, const ClusterSettings& settings);

// A store of other size is simulated in small: of as many more blocks as the trace has, with every path on its way through as many of them. By that
// factor (store of the trace over the other one) all is less but rates; what comes out is enlarged again. Pool and host memory: in bytes of the
// trace's store.
ClusterSettings shrunk(ClusterSettings settings, double factor);
ClusterResult enlarged(ClusterResult result, double factor);

// As many as it takes for a node to have some slots for each block, as far as the render has so many paths and a simulation of them takes seconds.
uint64_t suitable_repeats(const DemandTrace& trace, uint64_t render_paths, uint32_t slots);
// Paths of the trace that stand for a region of a render that goes region by region, with so many slots in each node. 0: the render is too short for
// that.
uint64_t paths_of_region(const DemandTrace& trace, uint64_t render_paths, uint32_t slots);
// Bytes of host memory that a simulation takes, about.
inline constexpr uint64_t most_simulation_bytes = uint64_t{4} << 30;
uint64_t simulation_bytes(const DemandTrace& trace, const ClusterSettings& settings);

}  // namespace raypager::bench
