#include "residency/policy.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>
#include <utility>

#include "residency/victims.hpp"

namespace raypager {
namespace {

double age(const BlockState& block, uint32_t round) { return block.requested_since ? double(round - block.requested_since) + 1.0 : 0.0; }

// How much waiting counts beside the number of rays that wait. Not at all (0), and a block that few want waits for very long; in full (1),
// and blocks come that few want. Replays of recorded renders move the fewest bytes in between (bench/journal/policies.md).
double patience(double rounds) { return std::sqrt(std::sqrt(rounds)); }

// Wants that differ by less than about this factor count as the same, so that blocks come in the order in which they lie in space: rays that
// waited for one of them find the next one beside it. Measured: 2, 4, 16 and 64 are better and better, 256 is so on clouds alone
// (bench/journal/the-paper.md).
constexpr int same_requests_bits = 6;  // 2^6

// floor(ilogb(x) / same_requests_bits) without the calls of either, which are much of what a round costs where very many blocks are wanted. REQUIRES:
// x is positive and neither tiny nor infinite.
double coarse_logarithm(double x) {
    constexpr int bias = 1023, lift = 1200;  // a multiple of same_requests_bits, so that nothing is negative
    static_assert(lift % same_requests_bits == 0 && lift > bias);
    const int exponent = static_cast<int>(std::bit_cast<uint64_t>(x) >> 52) - bias;
    const int coarse = (exponent + lift) / same_requests_bits - lift / same_requests_bits;
    return coarse;
}

// How much a block is wanted; the highest comes in first.
double load_score(PolicyKind kind, const BlockState& block, uint32_t round) {
    switch (kind) {
        case PolicyKind::aged_wants:
            return coarse_logarithm(block.requests * patience(age(block, round)) / block.bytes);
        case PolicyKind::most_wanted:
            return block.requests;
        case PolicyKind::wanted_per_byte:
            return double(block.requests) / block.bytes;
        case PolicyKind::lru:
            return age(block, round);
        case PolicyKind::sweep:
            return 0;  // has an order of its own
    }
    return 0;
}

// A block that may be loaded; the greatest comes first. Blocks of equal score come by turn.
struct Candidate {
    double score;
    uint32_t turn, block;
    bool operator<(const Candidate& other) const { return score != other.score ? score < other.score : turn > other.turn; }
};

// All absent blocks, in turn; nothing while no ray waits.
std::vector<Candidate> sweep_candidates(const PolicyInput& input) {
    bool waits = false;
    input.active.wanted.for_each([&](uint32_t i) { waits |= input.blocks[i].state == PageState::absent; });
    if (!waits) return {};
    std::vector<Candidate> candidates;
    const auto count = static_cast<uint32_t>(input.blocks.size());
    for (uint32_t i = 0; i < count; i++) {
        const uint32_t block = (input.next_in_turn + i) % count;
        if (input.blocks[block].state == PageState::absent) candidates.push_back({0, i, block});
    }
    return candidates;
}

// The blocks that may be loaded: those that are wanted, or all in turn.
std::vector<Candidate> load_candidates(const PolicySettings& settings, const PolicyInput& input) {
    if (settings.kind == PolicyKind::sweep) return sweep_candidates(input);
    std::vector<Candidate> wanted;
    wanted.reserve(input.active.wanted.size());
    input.active.wanted.for_each([&](uint32_t i) {
        const BlockState& block = input.blocks[i];
        if (block.state != PageState::absent) return;
        double score = load_score(settings.kind, block, input.round);
        const double rounds = age(block, input.round);
        if (settings.max_age && rounds > settings.max_age) score = 1e30 * rounds;
        // One way through the scene again and again, from where the last load was, so that none is always the last.
        wanted.push_back({score, settings.kind == PolicyKind::aged_wants ? turns_away(input, i) : i, i});
    });
    return wanted;
}

// Evicts as few as make room for so many bytes in one piece. Nothing if that cannot be: the rest of the pool is being loaded, or has not been seen by
// a round.
std::optional<PoolAddress> evict_for(uint64_t bytes, SlabAllocator& pool, Victims& victims, std::vector<uint32_t>& evict) {
    size_t count = 0;
    for (bool room = pool.fits(bytes); !room; count++) {
        const BlockState* victim = victims.next(count);
        if (!victim) break;
        room = pool.release(victim->address, victim->bytes) >= bytes;
    }
    const auto place = pool.allocate(bytes);
    if (place) {
        if (count > 0) victims.take(count, evict);
    } else {
        while (count-- > 0) pool.take_back(victims.next(count)->address, victims.next(count)->bytes);
    }
    return place;
}

// How many may be on their way while others must go for them.
uint32_t max_in_flight(const PolicySettings& settings, const PolicyInput& input) {
    constexpr double idle = 0.02;  // of the slots are ready
    return input.ready_rays < idle * input.slots ? std::max(settings.loads_in_flight, settings.loads_while_idle) : settings.loads_in_flight;
}

// What did not come: the last, which was the next, and the heap before it, which has what comes next at its front.
std::vector<uint32_t> blocks_behind(const std::vector<Candidate>& wanted) {
    constexpr size_t most = 512;  // more than come in a round
    std::vector<uint32_t> blocks;
    for (size_t i = 0; i < std::min(most, wanted.size()); i++) blocks.push_back((i == 0 ? wanted.back() : wanted[i - 1]).block);
    return blocks;
}

// Evicts for those of the wanted blocks that come next. No more than were under way if the loads that this makes room for came beside those that
// evict.
void make_room_ahead(const PolicySettings& settings, const PolicyInput& input, uint32_t in_flight, Victims& victims, Plan& plan) {
    const uint32_t most = max_in_flight(settings, input) + settings.evict_ahead;
    const size_t count = std::min<size_t>({settings.evict_ahead, most - std::min(most, in_flight), plan.behind.size()});
    uint64_t room = 0;
    for (size_t i = 0; i < count; i++) room += input.blocks[plan.behind[i]].bytes;
    while (plan.pool.free_bytes() < room) {
        const BlockState* victim = victims.next();
        if (!victim) break;
        plan.pool.release(victim->address, victim->bytes);
        victims.take(1, plan.evict);
    }
}

}  // namespace

bool counts_entries(PolicyKind kind) { return kind == PolicyKind::aged_wants; }

bool is_idle(PolicyKind kind, const BlockState& block) {
    if (counts_entries(kind)) return block.traffic == 0;
    return kind != PolicyKind::most_wanted || block.bounces == 0;
}

uint32_t turns_away(const PolicyInput& input, uint32_t block) {
    const auto count = static_cast<uint32_t>(input.blocks.size());
    return (block + count - input.next_in_turn % count) % count;
}

PolicySettings default_settings(PolicyKind kind) {
    PolicySettings settings;
    settings.kind = kind;
    if (kind == PolicyKind::most_wanted) {
        // The paper swaps once a round, whatever the rays that are ready.
        settings.loads_in_flight = 1;
        settings.hold_above_ready = 1.0;
    }
    // These two know nothing of the rays that are ready.
    if (kind == PolicyKind::lru || kind == PolicyKind::sweep) settings.hold_above_ready = 1.0;
    // Most wanted and wanted per byte can let a rarely wanted block wait for ever; the guard ends that.
    if (kind == PolicyKind::most_wanted || kind == PolicyKind::wanted_per_byte) settings.max_age = 4000;
    return settings;
}

PolicySettings default_settings(PolicyKind kind, uint64_t pool_bytes, uint64_t average_block_bytes, const DeviceProfile& profile) {
    PolicySettings settings = default_settings(kind);
    if (kind == PolicyKind::most_wanted) return settings;
    const uint64_t blocks = pool_bytes / std::max<uint64_t>(1, average_block_bytes);
    settings.loads_into_free = 256;
    const auto loads = [](uint64_t count, uint64_t most) { return static_cast<uint32_t>(std::clamp<uint64_t>(count, 2, most)); };
    const uint64_t for_cores = std::min<uint64_t>(blocks / profile.blocks_per_core_load, profile.core_loads);
    settings.loads_in_flight = loads(std::max(blocks / profile.blocks_per_load, for_cores), profile.max_loads);
    if (profile.blocks_per_idle_load) settings.loads_while_idle = loads(blocks / profile.blocks_per_idle_load, profile.max_idle_loads);
    if (profile.blocks_per_evict_ahead)
        settings.evict_ahead = static_cast<uint32_t>(std::min<uint64_t>(blocks / profile.blocks_per_evict_ahead, profile.max_evict_ahead));
    settings.traffic_kept = profile.traffic_kept;
    return settings;
}

Plan plan_paging(const PolicySettings& settings, const PolicyInput& input, SlabAllocator current) {
    Plan plan{{}, {}, {}, std::move(current)};
    SlabAllocator& pool = plan.pool;
    uint32_t in_flight = input.active.loading;
    // Few of those that are wanted come in at a time: a heap gives these in order without sorting the others.
    std::vector<Candidate> wanted = load_candidates(settings, input);
    std::make_heap(wanted.begin(), wanted.end());
    const bool hold = input.ready_rays > settings.hold_above_ready * input.slots;
    const uint32_t most = max_in_flight(settings, input);
    Victims victims(settings, input);
    bool full = false;  // of what cannot go
    for (; !wanted.empty(); wanted.pop_back()) {
        std::pop_heap(wanted.begin(), wanted.end());
        const uint32_t block = wanted.back().block;
        const uint64_t bytes = input.blocks[block].bytes;
        std::optional<PoolAddress> place;
        if (in_flight < settings.loads_into_free) place = pool.allocate(bytes);
        if (!place) {
            if (hold || in_flight >= most) break;
            place = evict_for(bytes, pool, victims, plan.evict);
            full = !place;
            if (full) break;
        }
        plan.load.push_back({block, *place, plan.evict.empty()});
        in_flight++;
    }
    plan.behind = blocks_behind(wanted);
    if (!hold && !full) make_room_ahead(settings, input, in_flight, victims, plan);
    return plan;
}

}  // namespace raypager
