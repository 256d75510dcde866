// The simulation of clusters: what must hold whatever the trace, and bounds that can be worked out by hand.
#include <gtest/gtest.h>

#include <numeric>

#include "bench/cluster_model.hpp"
#include "bench/cluster_store.hpp"
#include "bench_traces.hpp"
#include "store/shards.hpp"

namespace raypager::bench {
namespace {

// A long render of a trace, on nodes whose pools hold a part of the store; each path is traced four times.
ClusterSettings cluster_of(const DemandTrace& trace, uint32_t nodes, double pool_share = 0.3) {
    ClusterSettings settings;
    settings.node.policy = default_settings(PolicyKind::aged_wants);
    settings.node.pool_bytes =
        std::max<uint64_t>(trace.largest_block(), static_cast<uint64_t>(pool_share * static_cast<double>(trace.geometry_bytes())));
    settings.node.slots = 40;
    settings.node.visit_seconds = 1e-6;
    settings.nodes = nodes;
    settings.repeats = 4;
    settings.host_bytes = trace.geometry_bytes() / 2;
    settings.together = 50;
    settings.link = 1e9, settings.latency = 1e-7;
    return settings;
}

ClusterResult alone(const DemandTrace& trace, ClusterSettings settings) {
    settings.nodes = 1;
    settings.node.pool_bytes = trace.geometry_bytes();
    settings.host_bytes = 2 * trace.geometry_bytes();
    return simulate_cluster(trace, settings);
}

TEST(Cluster, every_ray_is_traced_and_what_is_sent_is_received) {
    for (const uint64_t seed : {1, 2, 3})
        for (const uint32_t nodes : {1u, 2u, 5u, 16u})
            for (const uint32_t under_way : {1u, 2u}) {
                SCOPED_TRACE(testing::Message() << "seed " << seed << ", " << nodes << " nodes, " << under_way << " rounds under way");
                const DemandTrace trace = random_trace(seed);
                ClusterSettings settings = cluster_of(trace, nodes);
                settings.node.rounds_under_way = under_way;
                const ClusterResult result = simulate_cluster(trace, settings);
                EXPECT_EQ(result.rays, 4 * trace.rays.size());
                EXPECT_EQ(result.received, result.sent);
                EXPECT_EQ(result.bytes_loaded, result.from_cache + result.from_own_shard + result.from_disk + result.received);
                EXPECT_GT(result.loads, 0u);
                EXPECT_EQ(result.received > 0, nodes > 1);
                EXPECT_GE(result.seconds, std::max({result.tracing, result.link_in, result.link_out, result.disk}));
            }
}

TEST(Cluster, is_the_same_every_time) {
    const DemandTrace trace = random_trace(4);
    const ClusterSettings settings = cluster_of(trace, 6);
    const ClusterResult a = simulate_cluster(trace, settings), b = simulate_cluster(trace, settings);
    EXPECT_EQ(std::tuple(a.seconds, a.loads, a.received, a.from_cache, a.rounds), std::tuple(b.seconds, b.loads, b.received, b.from_cache, b.rounds));
}

TEST(Cluster, one_node_with_everything_in_memory_asks_nobody) {
    const DemandTrace trace = random_trace(5);
    const ClusterResult result = alone(trace, cluster_of(trace, 1));
    EXPECT_EQ(result.received + result.sent + result.from_disk, 0u);
    EXPECT_LE(result.bytes_loaded, trace.geometry_bytes());
    EXPECT_NEAR(result.seconds, result.tracing, 1e-9);
    EXPECT_EQ(result.bound(), ClusterBound::device);
    EXPECT_EQ(result.store_in_memory, trace.geometry_bytes());
}

// It agrees with the replay of one device, whose loads come at once in either.
TEST(Cluster, one_node_does_as_its_replay) {
    const DemandTrace trace = random_trace(6, {.paths = 1500});
    ClusterSettings settings = cluster_of(trace, 1);
    settings.repeats = 1;
    settings.host_bytes = 2 * trace.geometry_bytes();
    for (const double bandwidth : {0.0, 1e8}) {
        settings.node.bandwidth = bandwidth;
        const ClusterResult cluster = simulate_cluster(trace, settings);
        const ReplayResult one = replay(trace, settings.node);
        EXPECT_EQ(cluster.rays, one.rays);
        EXPECT_NEAR(static_cast<double>(cluster.bytes_loaded) / static_cast<double>(one.bytes_loaded), 1, 0.1) << bandwidth;
        EXPECT_NEAR(cluster.seconds / one.seconds, 1, 0.1) << bandwidth;
    }
}

TEST(Cluster, without_limits_it_is_as_quick_as_its_nodes_together) {
    const DemandTrace trace = random_trace(7, {.paths = 8000});
    for (const uint32_t nodes : {2u, 8u}) {
        ClusterSettings settings = cluster_of(trace, nodes, 1.0);
        settings.link = 0, settings.latency = 0;
        const double efficiency = alone(trace, settings).seconds / nodes / simulate_cluster(trace, settings).seconds;
        EXPECT_GT(efficiency, 0.93) << nodes;
        EXPECT_LE(efficiency, 1.001) << nodes;
    }
}

TEST(Cluster, a_slow_link_takes_what_crosses_it) {
    const DemandTrace trace = random_trace(8);
    ClusterSettings settings = cluster_of(trace, 4);
    settings.link = 1e4;  // bytes a second
    const ClusterResult result = simulate_cluster(trace, settings);
    EXPECT_GE(result.seconds, static_cast<double>(std::max(result.most_received, result.most_sent)) / settings.link);
    EXPECT_LT(result.seconds, 4 * static_cast<double>(result.received) / settings.link);
    EXPECT_NE(result.bound(), ClusterBound::device);
    EXPECT_GT(result.seconds, 100 * result.tracing);
    // Latency alone, too, is waited for.
    settings.link = 0, settings.latency = 0.1;
    EXPECT_EQ(simulate_cluster(trace, settings).bound(), ClusterBound::waiting);
}

TEST(Cluster, quicker_links_never_take_longer) {
    for (const uint64_t seed : {9, 10}) {
        const DemandTrace trace = random_trace(seed, {.blocks = 40, .paths = 1000});
        ClusterSettings settings = cluster_of(trace, 4);
        double last = 1e30;
        for (const double link : {1e5, 1e6, 1e7, 1e8, 1e9, 1e10}) {
            settings.link = link;
            const double seconds = simulate_cluster(trace, settings).seconds;
            // What comes sooner may change what comes next: a little longer it may take by chance.
            EXPECT_LE(seconds, 1.05 * last) << "seed " << seed << ", link " << link;
            last = seconds;
        }
    }
}

TEST(Cluster, films_are_added_up_at_the_end) {
    const DemandTrace trace = random_trace(11);
    for (const auto& [nodes, steps] : {std::pair(1u, 0.0), {2u, 1.0}, {5u, 3.0}, {8u, 3.0}}) {
        ClusterSettings settings = cluster_of(trace, nodes);
        settings.film_bytes = 1 << 20;
        EXPECT_NEAR(simulate_cluster(trace, settings).film_seconds, steps * (1 << 20) / settings.link, 1e-9) << nodes;
    }
}

// A store that is a hundred times as large, of as many more blocks, with all else in proportion: it takes a hundred times as long, at the same rates.
TEST(Cluster, a_larger_store_is_the_same_picture_in_other_units) {
    const DemandTrace trace = random_trace(13, {.paths = 4000});
    ClusterSettings settings = cluster_of(trace, 4);
    settings.repeats = 1, settings.together = 0;
    settings.film_bytes = 1 << 20;
    settings.render_paths = trace.path_count();
    ClusterSettings large = settings;
    large.render_paths *= 100, large.node.slots *= 100, large.film_bytes *= 100;
    large.node.round_seconds *= 100, large.latency *= 100;
    const ClusterResult small = simulate_cluster(trace, settings), same = enlarged(simulate_cluster(trace, shrunk(large, 0.01)), 100);
    EXPECT_NEAR(same.seconds, 100 * small.seconds, 1e-6 * same.seconds);
    EXPECT_NEAR(static_cast<double>(same.received), 100 * static_cast<double>(small.received), 1);
    EXPECT_EQ(same.bound(), small.bound());
}

TEST(Cluster, ends_when_it_is_stopped) {
    const DemandTrace trace = random_trace(12);
    const std::atomic<bool> stop{true};
    ClusterSettings settings = cluster_of(trace, 3);
    settings.stop = &stop;
    EXPECT_LT(simulate_cluster(trace, settings).rays, 4 * trace.rays.size());
}

TEST(ClusterStore, is_divided_evenly) {
    std::vector<uint32_t> blocks;
    for (uint32_t i = 0; i < 1000; i++) blocks.push_back(64 * (1 + i * 37 % 20));
    const uint64_t all = std::accumulate(blocks.begin(), blocks.end(), uint64_t{0});
    const Shards roomy = divide_store(blocks, 7, all);
    EXPECT_EQ(roomy.bytes_in_memory, all);
    EXPECT_LE(std::ranges::max(roomy.bytes) - std::ranges::min(roomy.bytes), 64u * 20);
    // Room for half: three quarters of the memory of each.
    const uint64_t host = host_bytes_for_shard(all / 2 / 7);
    const Shards tight = divide_store(blocks, 7, host);
    EXPECT_NEAR(static_cast<double>(tight.bytes_in_memory) / static_cast<double>(all), 0.5, 0.02);
    EXPECT_LE(std::ranges::max(tight.bytes), shard_room(host));
    // In each part of the store, to a block or two.
    uint64_t seen = 0, in_memory = 0;
    for (size_t block = 0; block < blocks.size(); block++) {
        seen += blocks[block];
        if (tight.owner[block] != no_owner) in_memory += blocks[block];
        EXPECT_NEAR(static_cast<double>(in_memory), static_cast<double>(seen) / 2, 3 * 64 * 20) << block;
    }
    EXPECT_EQ(divide_store(blocks, 3, 0).bytes_in_memory, 0u);
}

TEST(ClusterStore, the_least_recently_used_block_leaves_the_cache) {
    CacheModel cache(300);
    cache.add(1, 100), cache.add(2, 100), cache.add(3, 100);
    EXPECT_TRUE(cache.use(1));
    cache.add(4, 150);  // 2 and 3 go
    EXPECT_TRUE(cache.use(1));
    EXPECT_FALSE(cache.use(2));
    EXPECT_FALSE(cache.use(3));
    EXPECT_EQ(cache.bytes(), 250u);
    cache.add(5, 301);
    EXPECT_FALSE(cache.use(5));
}

}  // namespace
}  // namespace raypager::bench
