// What a render would take on a cluster, without one: a short part of it is recorded, and simulated clusters replay that, with the speed that a
// forecast has measured of the device here. Every node has a device and limits like those of the options, and the scene's blocks lie in the memory of
// all together.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "raypager/forecast.hpp"

namespace raypager {

inline constexpr uint32_t max_cluster_nodes = 4096;

struct ClusterForecastOptions {
    std::vector<uint32_t> nodes;                    // how many there are, each 1 to max_cluster_nodes
    double link = 12.5e9;                           // bytes a second of a node's link, in each direction
    std::function<void(double fraction)> progress;  // of all that it does; may be empty
    const std::atomic<bool>* stop = nullptr;        // set from outside: an error of the kind "interrupted" follows soon
};

// Bytes are of the whole render. Those per second are means over it.
struct ClusterForecastRow {
    uint32_t nodes = 1;
    double seconds = 0;          // of rendering, and of adding up the films
    double efficiency = 1;       // seconds of one node with everything resident, over those of all nodes together
    std::string bound;           // for people: what it waits for most of the time
    double tracing_seconds = 0;  // that the mean node's device is busy
    double film_seconds = 0;
    double link_in = 0, link_out = 0;  // bytes a second of the busiest node
    uint64_t bytes_loaded = 0;         // onto all devices: the sum of the next four
    uint64_t bytes_from_cache = 0, bytes_from_own_shard = 0, bytes_received = 0, bytes_from_disk = 0;
    uint64_t host_limit = 0;              // of each node
    uint64_t shard_bytes = 0;             // of the largest shard
    uint64_t cached_bytes = 0;            // beside it, of the mean node, in the end
    uint64_t store_in_memory = 0;         // of all shards
    uint64_t whole_store_host_limit = 0;  // of each node, with which all of the store would be in memory
};

struct ClusterForecast {
    uint64_t store_bytes = 0;     // of all blocks and pages, in their stored form
    uint64_t recorded_paths = 0;  // that are replayed
    double resident_seconds = 0;  // of one node with everything resident, in the simulation
    // So many times what it takes with everything resident, a step of a ray takes within the limits: by this one node takes as long as was measured.
    double paging_cost = 1;
    double upload_rate = 0;                // bytes a second onto the device, measured
    std::vector<ClusterForecastRow> rows;  // one node first, then in the order of the options
};

// Scenes with instances cannot be recorded: a usage error says so.
Status check_cluster_forecast(const Blocks& scene);
// options: those of the forecast. measured: what it said.
Result<ClusterForecast> forecast_cluster(const Blocks& scene, const RenderOptions& options, const Forecast& measured,
                                         const ClusterForecastOptions& how, const RenderCallbacks& callbacks = {});

}  // namespace raypager
