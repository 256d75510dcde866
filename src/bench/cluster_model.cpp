#include "bench/cluster_model.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <memory>
#include <queue>
#include <utility>
#include <vector>

#include "base/check.hpp"
#include "bench/cluster_store.hpp"
#include "bench/device_replay.hpp"
#include "render/sample_pool.hpp"
#include "store/shards.hpp"
#include "wavefront/sample_order.hpp"

namespace raypager::bench {
namespace {

// Transfers one behind the other.
class Channel {
public:
    explicit Channel(double bandwidth) : bandwidth_(bandwidth) {}
    // When one can begin that is there from `now` on.
    double begin(double now) const { return std::max(now, free_); }
    // Carries it then; returns when it ends.
    double carry(double begin, uint64_t bytes) {
        const double seconds = bandwidth_ > 0 ? static_cast<double>(bytes) / bandwidth_ : 0;
        busy_ += seconds;
        bytes_ += bytes;
        return free_ = begin + seconds;
    }
    double busy() const { return busy_; }
    uint64_t bytes() const { return bytes_; }

private:
    double bandwidth_, free_ = 0, busy_ = 0;
    uint64_t bytes_ = 0;
};

// The numbers of all paths that are replayed, in their order: each stretch of `together` paths comes `repeats` times before the next.
class PathNumbers {
public:
    PathNumbers(const DemandTrace& trace, const ClusterSettings& settings)
        : paths_(trace.path_count()),
          repeats_(settings.repeats),
          together_(settings.together ? std::min<uint64_t>(settings.together, std::max<uint64_t>(1, paths_)) : std::max<uint64_t>(1, paths_)) {}
    uint64_t count() const { return paths_ * repeats_; }
    uint64_t path(uint64_t number) const {
        const uint64_t first = number / (together_ * repeats_) * together_;
        return first + (number - first * repeats_) % std::min(together_, paths_ - first);
    }

private:
    uint64_t paths_, repeats_, together_;
};

class ClusterRun {
public:
    ClusterRun(const DemandTrace& trace, const ClusterSettings& settings)
        : trace_(trace),
          settings_(settings),
          numbers_(trace, settings),
          shards_(divide_store(trace.block_bytes, settings.nodes, settings.host_bytes)),
          share_(settings.share_of(trace)),
          visit_seconds_(settings.node.visit_seconds / share_) {
        for (uint32_t i = 0; i < settings.nodes; i++) nodes_.push_back(std::make_unique<Node>(*this, i));
    }

    ClusterResult run() {
        for (uint32_t i = 0; i < nodes_.size(); i++) start_round(i, 0);
        while (!events_.empty() && !(settings_.stop && *settings_.stop)) {
            const Event event = events_.top();
            events_.pop();
            take(event);
        }
        return result();
    }

private:
    // What happens, in the order in which one block's way or a round has it. The node is the one that asked, or traces.
    enum class Kind { round_ended, asked_owner, on_the_wire, in_memory, on_device };
    struct Event {
        double time;
        uint64_t order;  // of those of one time
        Kind kind;
        uint32_t node, block;
        bool operator<(const Event& other) const { return time != other.time ? time > other.time : order > other.order; }
    };
    struct Node {
        Node(ClusterRun& run, uint32_t index)
            : device(run.trace_, {run.settings_.node.policy, run.settings_.node.pool_bytes, run.settings_.node.slab_bytes, run.slots(), false},
                     [&run, this] { return run.next_path(*this); }),
              cache(run.settings_.host_bytes - std::min(run.settings_.host_bytes, run.shards_.bytes[index])),
              in(run.settings_.link),
              out(run.settings_.link),
              bus(run.settings_.node.bandwidth),
              disk(run.settings_.disk) {}

        DeviceReplay device;
        CacheModel cache;
        Channel in, out, bus, disk;
        SampleRange range = {};         // of its paths' numbers, not begun
        std::vector<uint32_t> arrived;  // that the host has not seen yet
        uint32_t ready = 0;             // rays of the round under way
        uint32_t loading = 0;
        bool waits = false;  // for a load, with no round under way
        double tracing = 0, end = 0;
        uint64_t from_cache = 0, from_own_shard = 0;
    };

    std::optional<uint64_t> next_path(Node& node) {
        if (node.range.size() == 0) {
            const uint64_t left = numbers_.count() - taken_;
            if (left == 0) return std::nullopt;
            const uint64_t share = std::min(left, nodes_.size() > 1 ? share_of_node(left) : left);
            node.range = {taken_, taken_ + share};
            taken_ += share;
        }
        return numbers_.path(node.range.begin++);
    }

    // In paths that are replayed, what a node would take of those of the render.
    uint64_t share_of_node(uint64_t left) const {
        const auto of_render = [this](uint64_t paths) { return static_cast<uint64_t>(static_cast<double>(paths) / share_); };
        const auto share = static_cast<double>(next_share(of_render(left), of_render(numbers_.count()), nodes_.size())) * share_;
        return std::max<uint64_t>(1, static_cast<uint64_t>(share));
    }
    uint32_t slots() const { return static_cast<uint32_t>(std::max(1.0, std::round(settings_.node.slots * share_))); }

    void push(double time, Kind kind, uint32_t node, uint32_t block = 0) { events_.push({time, order_++, kind, node, block}); }

    void take(const Event& event) {
        Node& node = *nodes_[event.node];
        const uint64_t bytes = trace_.block_bytes[event.block];
        if (event.kind == Kind::round_ended) {
            end_round(event.node, event.time);
        } else if (event.kind == Kind::asked_owner) {
            Channel& out = nodes_[shards_.owner[event.block]]->out;
            const double begin = out.begin(event.time);
            out.carry(begin, bytes);
            push(begin, Kind::on_the_wire, event.node, event.block);
        } else if (event.kind == Kind::on_the_wire) {
            push(node.in.carry(node.in.begin(event.time), bytes), Kind::in_memory, event.node, event.block);
        } else if (event.kind == Kind::in_memory) {
            push(node.bus.carry(node.bus.begin(event.time), bytes), Kind::on_device, event.node, event.block);
        } else {
            node.arrived.push_back(event.block);
            node.loading--;
            if (!node.waits) return;
            node.waits = false;
            take_arrivals(node);
            start_round(event.node, event.time);
        }
    }

    void start_round(uint32_t index, double now) {
        Node& node = *nodes_[index];
        node.end = now;
        const auto round = node.device.start_round();
        if (!round) return;
        node.ready = round->ready;
        const double seconds = settings_.node.round_seconds + static_cast<double>(round->visits) * visit_seconds_;
        node.tracing += round->ready ? seconds : 0;
        push(now + seconds, Kind::round_ended, index);
    }

    void end_round(uint32_t index, double now) {
        Node& node = *nodes_[index];
        bool arrived = false;
        // With nothing to trace, no round is started before the host has seen to it.
        while (node.device.under_way() >= (node.ready == 0 ? 1 : settings_.node.rounds_under_way)) {
            node.device.see_oldest();
            arrived |= take_arrivals(node);
            for (const PlannedLoad& load : node.device.plan()) request(index, load.block, now);
        }
        node.waits = !arrived && (node.ready == 0 || settings_.node.wait_for_loads) && node.loading > 0 && node.arrived.empty();
        if (node.waits) return;
        take_arrivals(node);
        start_round(index, now);
    }

    // What has come is seen from the next round on that starts.
    bool take_arrivals(Node& node) {
        for (const uint32_t block : node.arrived) node.device.arrive(block);
        return !std::exchange(node.arrived, {}).empty();
    }

    void request(uint32_t index, uint32_t block, double now) {
        Node& node = *nodes_[index];
        const uint64_t bytes = trace_.block_bytes[block];
        node.loading++;
        if (node.cache.use(block)) {
            node.from_cache += bytes;
            push(now, Kind::in_memory, index, block);
            return;
        }
        node.cache.add(block, bytes);
        const uint32_t owner = shards_.owner[block];
        if (owner == index) {
            node.from_own_shard += bytes;
            push(now, Kind::in_memory, index, block);
        } else if (owner == no_owner) {
            push(node.disk.carry(node.disk.begin(now), bytes), Kind::in_memory, index, block);
        } else {
            push(now + settings_.latency, Kind::asked_owner, index, block);
        }
    }

    ClusterResult result() const {
        ClusterResult result;
        for (const auto& node : nodes_) {
            result.seconds = std::max(result.seconds, node->end);
            result.tracing += node->tracing / settings_.nodes;
            result.bus = std::max(result.bus, node->bus.busy()), result.disk = std::max(result.disk, node->disk.busy());
            result.link_in = std::max(result.link_in, node->in.busy()), result.link_out = std::max(result.link_out, node->out.busy());
            result.loads += node->device.paging().loads, result.bytes_loaded += node->device.paging().bytes_loaded;
            result.from_cache += node->from_cache, result.from_own_shard += node->from_own_shard, result.from_disk += node->disk.bytes();
            result.received += node->in.bytes(), result.sent += node->out.bytes();
            result.most_received = std::max(result.most_received, node->in.bytes());
            result.most_sent = std::max(result.most_sent, node->out.bytes());
            result.rays += node->device.rays(), result.rounds = std::max<uint64_t>(result.rounds, node->device.rounds());
            result.cached_bytes += node->cache.bytes() / settings_.nodes;
        }
        result.shard_bytes = std::ranges::max(shards_.bytes);
        result.store_in_memory = shards_.bytes_in_memory;
        const auto steps = static_cast<double>(std::bit_width(settings_.nodes - 1));
        result.film_seconds = settings_.link > 0 ? steps * static_cast<double>(settings_.film_bytes) / settings_.link : 0;
        result.seconds += result.film_seconds;
        return result;
    }

    const DemandTrace& trace_;
    const ClusterSettings& settings_;
    const PathNumbers numbers_;
    const Shards shards_;
    const double share_, visit_seconds_;
    std::vector<std::unique_ptr<Node>> nodes_;
    std::priority_queue<Event> events_;
    uint64_t taken_ = 0, order_ = 0;
};

}  // namespace

double ClusterSettings::share_of(const DemandTrace& trace) const {
    const auto replayed = static_cast<double>(trace.path_count()) * static_cast<double>(repeats);
    const double all = render_paths ? static_cast<double>(render_paths) : static_cast<double>(trace.recorded.paths) * static_cast<double>(repeats);
    return all > 0 && replayed > 0 ? replayed / all : 1;
}

std::string_view bound_name(ClusterBound bound) {
    switch (bound) {
        case ClusterBound::device:
            return "the device";
        case ClusterBound::bus:
            return "the bus to the device";
        case ClusterBound::link_in:
            return "a link, receiving";
        case ClusterBound::link_out:
            return "a link, sending";
        case ClusterBound::disk:
            return "a disk";
        case ClusterBound::film:
            return "adding up films";
        case ClusterBound::waiting:
            return "waits for single blocks";
    }
    return "?";
}

ClusterBound ClusterResult::bound() const {
    ClusterBound most = ClusterBound::device;
    double busy = tracing;
    const std::pair<ClusterBound, double> others[] = {{ClusterBound::bus, bus},
                                                      {ClusterBound::link_in, link_in},
                                                      {ClusterBound::link_out, link_out},
                                                      {ClusterBound::disk, disk},
                                                      {ClusterBound::film, film_seconds}};
    for (const auto& [bound, seconds] : others)
        if (seconds > busy) most = bound, busy = seconds;
    constexpr double mostly = 0.6;  // of the time
    return busy < mostly * seconds ? ClusterBound::waiting : most;
}

ClusterResult simulate_cluster(const DemandTrace& trace, const ClusterSettings& settings) {
    RAYPAGER_CHECK(settings.nodes > 0 && settings.nodes <= max_cluster_nodes && settings.repeats > 0);
    return ClusterRun(trace, settings).run();
}

ClusterSettings shrunk(ClusterSettings settings, double factor) {
    const auto times = [factor](auto value) { return static_cast<decltype(value)>(std::max(1.0, std::round(factor * static_cast<double>(value)))); };
    settings.render_paths = times(settings.render_paths);
    settings.node.slots = times(settings.node.slots);
    settings.node.round_seconds *= factor;
    settings.latency *= factor;
    settings.film_bytes = static_cast<uint64_t>(std::llround(factor * static_cast<double>(settings.film_bytes)));
    return settings;
}

ClusterResult enlarged(ClusterResult result, double factor) {
    for (double* seconds : {&result.seconds, &result.tracing, &result.film_seconds, &result.bus, &result.link_in, &result.link_out, &result.disk})
        *seconds *= factor;
    for (uint64_t* count :
         {&result.loads, &result.bytes_loaded, &result.from_cache, &result.from_own_shard, &result.from_disk, &result.received, &result.sent,
          &result.most_received, &result.most_sent, &result.rays, &result.shard_bytes, &result.store_in_memory, &result.cached_bytes})
        *count = static_cast<uint64_t>(std::llround(factor * static_cast<double>(*count)));
    return result;
}

uint64_t suitable_repeats(const DemandTrace& trace, uint64_t render_paths, uint32_t slots) {
    constexpr double slots_of_a_block = 4, fewest_slots = 1024, most_paths = 16e6;
    const auto paths = static_cast<double>(std::max<uint64_t>(1, trace.path_count())), all = static_cast<double>(render_paths);
    const double wanted = std::max(fewest_slots, slots_of_a_block * static_cast<double>(trace.block_bytes.size()));
    const double replayed = std::min({all * wanted / std::max(1u, slots), all, most_paths});
    return static_cast<uint64_t>(std::max(1.0, std::round(replayed / paths)));
}

uint64_t paths_of_region(const DemandTrace& trace, uint64_t render_paths, uint32_t slots) {
    // Where blocks are swapped, half of the slots wait (render/plan.cpp).
    const uint64_t of_render = std::max<uint64_t>(1, region_paths_per_slot * slots / 2);
    if (render_paths < min_regions * of_render) return 0;
    const double share = static_cast<double>(trace.path_count()) / static_cast<double>(render_paths);
    return std::max<uint64_t>(1, static_cast<uint64_t>(static_cast<double>(of_render) * share));
}

uint64_t simulation_bytes(const DemandTrace& trace, const ClusterSettings& settings) {
    constexpr uint64_t of_a_block = 160, of_a_slot = 40;
    const auto slots = static_cast<uint64_t>(settings.node.slots * std::min(1.0, settings.share_of(trace)));
    return settings.nodes * (of_a_block * trace.block_bytes.size() + of_a_slot * slots);
}

}  // namespace raypager::bench
