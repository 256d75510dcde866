#include "bench/bounds.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

namespace raypager::bench {
namespace {

constexpr uint64_t never = UINT64_MAX;

// For each entry of the service order, the next round that uses its block.
std::vector<uint64_t> next_uses(const ServiceOrder& service, size_t block_count) {
    std::vector<uint64_t> next(service.blocks.size()), upcoming(block_count, never);
    for (size_t round = service.begin.size() - 1; round-- > 0;) {
        for (uint64_t i = service.begin[round]; i < service.begin[round + 1]; i++) next[i] = upcoming[service.blocks[i]];
        for (uint64_t i = service.begin[round]; i < service.begin[round + 1]; i++) upcoming[service.blocks[i]] = round;
    }
    return next;
}

// The blocks that each path must enter, without repetition.
struct Needs {
    std::vector<uint32_t> blocks;
    std::vector<uint64_t> begin = {0};
    size_t path_count() const { return begin.size() - 1; }
};

Needs find_needs(const DemandTrace& trace) {
    Needs needs;
    std::vector<uint32_t> mine;
    for (size_t path = 0; path < trace.path_count(); path++) {
        mine.clear();
        for (uint64_t i = trace.path_rays[path]; i < trace.path_rays[path + 1]; i++) {
            const auto visits = trace.visits_of(trace.rays[i]);
            if (std::any_of(visits.begin(), visits.end(), [](const Visit& visit) { return visit.stops(); })) continue;
            for (const Visit& visit : visits) mine.push_back(visit.block());
        }
        std::sort(mine.begin(), mine.end());
        needs.blocks.insert(needs.blocks.end(), mine.begin(), std::unique(mine.begin(), mine.end()));
        needs.begin.push_back(needs.blocks.size());
    }
    return needs;
}

// Bytes of the blocks that all but `left_out` of the paths first .. last - 1 need, from below.
class Window {
public:
    Window(const Needs& needs, const std::vector<uint32_t>& block_bytes, size_t first, size_t last)
        : needs_(needs), bytes_(block_bytes), first_(first), last_(last), load_(block_bytes.size()), pull_(block_bytes.size(), 1.0) {
        spread();
        for (size_t block = 0; block < load_.size(); block++)
            if (load_[block] > 0) touched_ += bytes_[block];
    }

    double min_bytes(double left_out) {
        if (left_out <= 0) return touched_;
        constexpr int steps = 6;
        double best = bound(left_out);
        for (int step = 0; step < steps; step++) {
            for (size_t block = 0; block < load_.size(); block++)
                if (load_[block] > 0) pull_[block] *= std::clamp(std::sqrt(bytes_[block] / load_[block] * total_load_ / touched_), 0.1, 10.0);
            spread();
            best = std::max(best, bound(left_out));
        }
        return best;
    }

private:
    // Each path spreads one unit over its blocks, in proportion to their pull.
    void spread() {
        std::fill(load_.begin(), load_.end(), 0.0);
        total_load_ = 0;
        for (size_t path = first_; path < last_; path++) {
            double sum = 0;
            for (uint64_t i = needs_.begin[path]; i < needs_.begin[path + 1]; i++) sum += pull_[needs_.blocks[i]];
            if (sum == 0) continue;
            for (uint64_t i = needs_.begin[path]; i < needs_.begin[path + 1]; i++) load_[needs_.blocks[i]] += pull_[needs_.blocks[i]] / sum;
            total_load_ += 1;
        }
    }

    // The most bytes that can be left out for so many units: those first that hold the fewest units a byte, the last one in part.
    double bound(double left_out) const {
        std::vector<uint32_t> order;
        for (uint32_t block = 0; block < load_.size(); block++)
            if (load_[block] > 0) order.push_back(block);
        std::sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) { return load_[a] * bytes_[b] < load_[b] * bytes_[a]; });
        double omitted = 0;
        for (const uint32_t block : order) {
            const double part = std::min(1.0, left_out / load_[block]);
            omitted += part * bytes_[block];
            left_out -= part * load_[block];
            if (part < 1) break;
        }
        return std::max(0.0, touched_ - omitted);
    }

    const Needs& needs_;
    const std::vector<uint32_t>& bytes_;
    size_t first_, last_;
    std::vector<double> load_, pull_;  // by block
    double total_load_ = 0, touched_ = 0;
};

}  // namespace

uint64_t furthest_next_use_bytes(const ServiceOrder& service, const std::vector<uint32_t>& block_bytes, uint64_t pool_bytes) {
    const std::vector<uint64_t> next = next_uses(service, block_bytes.size());
    std::set<std::pair<uint64_t, uint32_t>> by_next_use;  // of what is in the pool
    std::vector<uint64_t> key(block_bytes.size());
    std::vector<bool> inside(block_bytes.size());
    uint64_t used = 0, moved = 0;
    for (size_t round = 0; round + 1 < service.begin.size(); round++) {
        // What this round needs is in the pool and not up for eviction.
        for (uint64_t i = service.begin[round]; i < service.begin[round + 1]; i++) {
            const uint32_t block = service.blocks[i];
            if (inside[block]) {
                by_next_use.erase({key[block], block});
                continue;
            }
            inside[block] = true;
            used += block_bytes[block];
            moved += block_bytes[block];
        }
        while (used > pool_bytes && !by_next_use.empty()) {
            const auto victim = std::prev(by_next_use.end());
            inside[victim->second] = false;
            used -= block_bytes[victim->second];
            by_next_use.erase(victim);
        }
        for (uint64_t i = service.begin[round]; i < service.begin[round + 1]; i++) {
            key[service.blocks[i]] = next[i];
            by_next_use.insert({next[i], service.blocks[i]});
        }
    }
    return moved;
}

uint64_t min_bytes(const DemandTrace& trace, uint32_t slots, uint64_t pool_bytes) {
    const Needs needs = find_needs(trace);
    const size_t paths = needs.path_count();
    double best = Window(needs, trace.block_bytes, 0, paths).min_bytes(0);  // each block at least once
    for (const double length : {1.5, 2.0, 3.0, 4.0, 8.0, 16.0}) {
        const auto window = static_cast<size_t>(std::ceil(length * slots));
        if (window >= paths) break;
        double sum = 0;
        for (size_t first = 0; first < paths; first += window) {
            const size_t last = std::min(paths, first + window);
            const double bytes = Window(needs, trace.block_bytes, first, last).min_bytes(last < paths ? slots : 0.0);
            sum += std::max(0.0, first == 0 ? bytes : bytes - static_cast<double>(pool_bytes));
        }
        best = std::max(best, sum);
    }
    return static_cast<uint64_t>(best);
}

}  // namespace raypager::bench
