// What is known of blocks from round to round, against a model that looks at all of them each time.
#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <random>

#include "residency/block_table.hpp"

namespace raypager {
namespace {

TEST(BlockTable, counted_entries_fade) {
    const std::vector<uint32_t> bytes = {64, 64};
    BlockTable table(bytes, SlabAllocator({128}), default_settings(PolicyKind::aged_wants, 128, 64, profile_of_cores(0)));
    const auto told = [&](uint32_t round, std::initializer_list<rp_block_demand> demand) { table.take_demand(round, demand); };
    told(1, {{0, 0, 0, UINT32_MAX - 9}});
    told(2, {{0, 0, 0, 20}});  // past the end of 32 bits
    const double before = table.blocks()[0].traffic;
    told(3, {{1, 0, 0, 5}});
    EXPECT_LT(table.blocks()[0].traffic, before);
    EXPECT_GT(table.blocks()[0].traffic, before / 2);
    EXPECT_EQ(table.blocks()[1].traffic, 5);
    for (uint32_t round = 4; round < 100; round++) told(round, {});
    EXPECT_EQ(table.blocks()[0].traffic, 0);
    EXPECT_EQ(table.blocks()[0].last_used, 2u);
}

TEST(BlockTable, what_is_not_told_of_stays_but_bounces) {
    const std::vector<uint32_t> bytes = {64, 64};
    BlockTable table(bytes, SlabAllocator({128}), default_settings(PolicyKind::most_wanted));
    table.take_demand(1, std::initializer_list<rp_block_demand>{{0, 3, 7, 1}});
    table.take_demand(2, {});
    EXPECT_EQ(table.blocks()[0].requests, 3u);
    EXPECT_EQ(table.blocks()[0].requested_since, 1u);
    EXPECT_EQ(table.blocks()[0].last_used, 1u);
    EXPECT_EQ(table.blocks()[0].bounces, 0u);
    table.forget_demand();
    EXPECT_EQ(table.blocks()[0].requests, 0u);
    EXPECT_TRUE(table.plan(3, 0, 100).load.empty());
}

// The rules in their plainest form: all words of all blocks in each round.
class Model {
public:
    Model(const std::vector<uint32_t>& bytes, const SlabAllocator& pool, const PolicySettings& policy)
        : blocks_(bytes.size()), pool_(pool), policy_(policy) {
        for (size_t i = 0; i < bytes.size(); i++) blocks_[i].bytes = bytes[i];
    }
    void take(uint32_t round, const std::vector<rp_block_demand>& demand) {
        for (size_t i = 0; i < blocks_.size(); i++) {
            BlockState& block = blocks_[i];
            block.requests = demand[i].requests;
            block.bounces = demand[i].bounces;
            if (counts_entries(policy_.kind)) {
                const uint32_t entered = demand[i].used - block.entries;
                block.entries = demand[i].used;
                block.traffic = block.traffic * policy_.traffic_kept + entered;
                if (block.traffic < 1) block.traffic = 0;
                if (entered > 0) block.last_used = std::max(block.last_used, round);
            } else {
                block.last_used = std::max(block.last_used, demand[i].used);
            }
            if (block.requests == 0)
                block.requested_since = 0;
            else if (block.requested_since == 0)
                block.requested_since = round;
        }
    }
    void arrive(uint32_t round, uint32_t i) {
        blocks_[i].state = PageState::resident;
        blocks_[i].resident_since = blocks_[i].last_used = round + 1;
    }
    Plan plan(uint32_t round, uint32_t ready, uint32_t slots) {
        Plan plan = plan_paging(policy_, {blocks_, ActiveBlocks(blocks_), round, ready, slots, next_in_turn_}, pool_);
        expect_least_needed(plan.evict, round);
        pool_ = plan.pool;
        for (const uint32_t block : plan.evict) {
            blocks_[block].state = PageState::absent;
            blocks_[block].requested_since = blocks_[block].requests > 0 ? round + 1 : 0;  // from the next round on
        }
        for (const PlannedLoad& load : plan.load) {
            blocks_[load.block].state = PageState::loading;
            blocks_[load.block].address = load.address;
            next_in_turn_ = static_cast<uint32_t>((load.block + 1) % blocks_.size());
        }
        return plan;
    }
    const std::vector<BlockState>& blocks() const { return blocks_; }

private:
    // Of all that may go, those that are needed least, in that order.
    void expect_least_needed(const std::vector<uint32_t>& evicted, uint32_t round) const {
        if (policy_.kind == PolicyKind::sweep) return;
        std::vector<uint32_t> order;
        for (uint32_t i = 0; i < blocks_.size(); i++)
            if (blocks_[i].state == PageState::resident && blocks_[i].resident_since <= round) order.push_back(i);
        const bool by_bounces = policy_.kind == PolicyKind::most_wanted, by_traffic = counts_entries(policy_.kind);
        std::sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) {
            const BlockState &x = blocks_[a], &y = blocks_[b];
            if (by_traffic && x.traffic != y.traffic) return x.traffic < y.traffic;
            if (!by_bounces && x.last_used != y.last_used) return x.last_used < y.last_used;
            if (x.bounces != y.bounces) return x.bounces < y.bounces;
            if (x.last_used != y.last_used) return x.last_used < y.last_used;
            return a < b;
        });
        ASSERT_LE(evicted.size(), order.size());
        EXPECT_TRUE(std::equal(evicted.begin(), evicted.end(), order.begin()));
    }

    std::vector<BlockState> blocks_;
    SlabAllocator pool_;
    PolicySettings policy_;
    uint32_t next_in_turn_ = 0;
};

void expect_same(const BlockState& a, const BlockState& b) {
    EXPECT_EQ(a.state, b.state);
    EXPECT_EQ(a.requests, b.requests);
    EXPECT_EQ(a.bounces, b.bounces);
    EXPECT_EQ(a.last_used, b.last_used);
    EXPECT_EQ(a.entries, b.entries);
    EXPECT_EQ(a.traffic, b.traffic);
    EXPECT_EQ(a.requested_since, b.requested_since);
    EXPECT_EQ(a.resident_since, b.resident_since);
    EXPECT_TRUE(a.state == PageState::absent || a.address == b.address);
}

// Rounds of random demand, of which one side is told all and the other what has changed: the same is known, and decided, of every block.
class ManyRounds {
public:
    ManyRounds(uint32_t seed, PolicyKind kind) : random_(seed), policy_(make_policy(kind)), bytes_(make_bytes()) {
        const SlabAllocator pool(std::vector<uint64_t>(1 + below(2), 64 * (8 + below(80))));
        table_.emplace(bytes_, pool, policy_);
        model_.emplace(bytes_, pool, table_->policy());
        for (uint32_t i = 0; i < bytes_.size(); i++) words_.push_back({i, 0, 0, 0});
    }
    void run() {
        for (uint32_t round = 1; round <= 150 && !testing::Test::HasFailure(); round++) {
            SCOPED_TRACE(testing::Message() << "round " << round);
            std::vector<rp_block_demand> told = change(round);
            model_->take(round, words_);
            table_->take_demand(round, told);
            for (rp_block_demand& word : words_) word.bounces = 0;
            arrive(round);
            const uint32_t ready = below(100);
            const Plan plan = table_->plan(round, ready, 100), expected = model_->plan(round, ready, 100);
            EXPECT_EQ(plan.evict, expected.evict);
            EXPECT_EQ(plan.behind, expected.behind);
            ASSERT_EQ(plan.load.size(), expected.load.size());
            for (size_t i = 0; i < plan.load.size(); i++) {
                EXPECT_EQ(plan.load[i].block, expected.load[i].block);
                EXPECT_EQ(plan.load[i].address, expected.load[i].address);
                on_their_way_.push_back(plan.load[i].block);
            }
            evictions_ += plan.evict.size();
            for (uint32_t i = 0; i < bytes_.size(); i++) expect_same(table_->blocks()[i], model_->blocks()[i]);
        }
    }
    size_t evictions() const { return evictions_; }

private:
    uint32_t below(uint32_t n) { return static_cast<uint32_t>(random_() % n); }
    PolicySettings make_policy(PolicyKind kind) {
        PolicySettings policy = default_settings(kind);
        policy.loads_in_flight = 1 + below(6);
        policy.evict_ahead = below(4);
        policy.traffic_kept = std::vector<double>{0, 0.5, 0.8, 0.95}[below(4)];
        return policy;
    }
    std::vector<uint32_t> make_bytes() {
        std::vector<uint32_t> bytes(20 + below(200));
        for (uint32_t& of_block : bytes) of_block = 64 * (1 + below(8));
        return bytes;
    }
    // What the kernels of a round do. Some blocks are told of although nothing has changed.
    std::vector<rp_block_demand> change(uint32_t round) {
        std::vector<rp_block_demand> told;
        for (rp_block_demand& word : words_) {
            const PageState state = table_->blocks()[word.block].state;
            const bool changes = below(4) == 0;
            if (!changes && below(10) != 0) continue;
            if (changes && state == PageState::resident) {
                word.requests = below(30) == 0 ? 1 : 0;
                word.used = counts_entries(policy_.kind) ? word.used + below(30) : round;
                word.bounces = policy_.kind == PolicyKind::most_wanted ? below(3) : 0;
            } else if (changes) {
                word.requests = below(3) * below(50);
            }
            told.push_back(word);
        }
        std::shuffle(told.begin(), told.end(), random_);
        return told;
    }
    void arrive(uint32_t round) {
        while (!on_their_way_.empty() && below(3) != 0) {
            table_->arrive(round, on_their_way_.back());
            model_->arrive(round, on_their_way_.back());
            on_their_way_.pop_back();
        }
    }

    std::mt19937 random_;
    PolicySettings policy_;
    std::vector<uint32_t> bytes_;
    std::optional<BlockTable> table_;
    std::optional<Model> model_;
    std::vector<rp_block_demand> words_;
    std::vector<uint32_t> on_their_way_;
    size_t evictions_ = 0;
};

TEST(BlockTable, knows_from_changes_what_all_words_would_tell) {
    const uint32_t seed = std::random_device{}();
    size_t evictions = 0;
    for (const auto& policy : policy_names)
        for (uint32_t trial = 0; trial < 20; trial++) {
            SCOPED_TRACE(testing::Message() << policy.name << ", seed " << seed + trial);
            ManyRounds rounds(seed + trial, policy.kind);
            rounds.run();
            ASSERT_FALSE(HasFailure());
            evictions += rounds.evictions();
        }
    EXPECT_GT(evictions, 1000u);
}

}  // namespace
}  // namespace raypager
