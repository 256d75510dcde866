// The first stage of a round, with streams, against the rule in plain C++: which slots can go on, which wait, which are free.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <random>
#include <set>
#include <utility>

#include "device/device.hpp"
#include "raypager/abi/block.h"
#include "raypager/abi/path.h"
#include "support/device_scene.hpp"
#include "support/probe_kernels.hpp"
#include "wavefront/sleep_groups.hpp"

namespace raypager {
namespace {

constexpr uint32_t work_items = 5;

// A render in small: what the other stages do to slots, without rays.
class WakeStream : public testing::Test {
protected:
    static constexpr uint32_t slots = 5003, blocks = 2297;  // not a multiple of anything; more blocks than bundles

    void SetUp() override {
        auto device = Device::open("", 0);
        ASSERT_TRUE(device.ok()) << device.status().message();
        device_ = std::move(*device);
        for (rp_page& page : pages_) page = {RP_NONE, 0, 0, 0};
        pages_on_device_ = pages_;
        awake_.back() >>= RP_AWAKE_SLOTS - slots % RP_AWAKE_SLOTS;
    }

    uint32_t phase(uint32_t slot) const { return status_[slot] & RP_PHASE_MASK; }
    bool waits(uint32_t slot) const { return phase(slot) >= RP_PHASE_EXTEND_WAITS; }
    bool absent(uint32_t block) const { return pages_[block].address == RP_NONE; }

    // The slot's path is in the block now. Slots that wait join a list of the block's, as rp_wait_for_block_in_chain has it.
    void set(uint32_t slot, uint32_t phase, uint32_t block) {
        const uint32_t flags = phase == RP_PHASE_SHADOW || phase == RP_PHASE_SHADOW_WAITS   ? RP_STATUS_ENDS
                               : phase == RP_PHASE_EXTEND || phase == RP_PHASE_EXTEND_WAITS ? RP_STATUS_CONNECTED | RP_STATUS_LIT
                                                                                            : 0;
        kept_[slot] = (static_cast<uint32_t>(random_() % 200) << RP_STATUS_OFFSET_SHIFT) | (static_cast<uint32_t>(random_()) & flags);
        status_[slot] = phase | kept_[slot];
        block_of_[slot] = block;
        if (!waits(slot)) {
            status_[slot] |= block << RP_STATUS_BLOCK_SHIFT;
            return;
        }
        const size_t list = 2 * RP_LISTS * block + (phase == RP_PHASE_SHADOW_WAITS ? RP_LISTS : 0) + random_() % RP_LISTS;
        status_[RP_STATUS_WORDS(slots) + slot] = std::exchange(demand_[RP_DEMAND_LISTS_AT(blocks) + list], slot + 1);
        demand_[RP_DEMAND_REQUESTS * blocks + block]++;
        counters_[RP_COUNT_IN_LISTS]++;
    }

    // Lists what can be done, and checks that it is what has to be. Returns the slots that are to do something. named: whether it is told which
    // blocks have come.
    std::vector<uint32_t> wake(bool named) {
        std::set<uint32_t> extend, shadow, free;
        uint32_t waiting = 0;
        const std::vector<uint32_t> before = status_;
        for (uint32_t slot = 0; slot < slots; slot++) {
            const uint32_t now = phase(slot);
            if (waits(slot) && absent(block_of_[slot]))
                waiting++;
            else if (now == RP_PHASE_FREE)
                free.insert(slot);
            else if (now == RP_PHASE_SHADOW || now == RP_PHASE_SHADOW_WAITS)
                shadow.insert(slot);
            else if (now != RP_PHASE_IDLE)
                extend.insert(slot);
        }
        launch(named);
        if (HasFatalFailure()) return {};
        const std::vector<uint32_t> extend_list(queue_.begin(), queue_.begin() + counters_[RP_COUNT_EXTEND]);
        const std::vector<uint32_t> shadow_list(queue_.rbegin() + work_items, queue_.rbegin() + work_items + counters_[RP_COUNT_SHADOW]);
        std::vector<uint32_t> listed(free_.begin(), free_.begin() + counters_[RP_COUNT_FREE]);
        EXPECT_EQ(extend_list.size(), extend.size());
        EXPECT_EQ(shadow_list.size(), shadow.size());
        EXPECT_EQ(listed.size(), free.size());
        EXPECT_EQ(std::set<uint32_t>(extend_list.begin(), extend_list.end()), extend);
        EXPECT_EQ(std::set<uint32_t>(shadow_list.begin(), shadow_list.end()), shadow);
        EXPECT_EQ(std::set<uint32_t>(listed.begin(), listed.end()), free);
        EXPECT_EQ(counters_[RP_COUNT_IN_LISTS], waiting);
        std::vector<uint32_t> requests(blocks);
        for (uint32_t slot = 0; slot < slots; slot++) {
            const bool waits_on = waits(slot);
            requests[block_of_[slot]] += waits_on ? 1 : 0;
            EXPECT_EQ(awake_[slot / RP_AWAKE_SLOTS] >> slot % RP_AWAKE_SLOTS & 1, waits_on || phase(slot) == RP_PHASE_IDLE ? 0u : 1u);
        }
        for (uint32_t block = 0; block < blocks; block++) {
            EXPECT_EQ(demand_[RP_DEMAND_REQUESTS * blocks + block], requests[block]);
            if (absent(block)) continue;
            const auto lists = demand_.begin() + RP_DEMAND_LISTS_AT(blocks) + 2 * RP_LISTS * block;
            EXPECT_EQ(std::count(lists, lists + 2 * RP_LISTS, 0u), 2 * RP_LISTS);
        }
        for (const auto* list : {&extend_list, &shadow_list}) {
            // Every work-item lists its rays by bundles, each in the order of their slots.
            uint32_t falls = 0;
            std::pair<uint64_t, uint32_t> last;
            for (const uint32_t slot : *list) {
                // Who had waited goes on from there; what else the word says is as it was.
                const bool had_waited = (before[slot] & RP_PHASE_MASK) >= RP_PHASE_EXTEND_WAITS;
                const uint32_t what = list == &extend_list ? RP_PHASE_EXTEND : RP_PHASE_SHADOW;
                EXPECT_EQ(status_[slot] >> RP_STATUS_BLOCK_SHIFT, block_of_[slot]);
                EXPECT_EQ(status_[slot] & ~RP_STATUS_BLOCK_MASK,
                          what | kept_[slot] | (had_waited ? RP_STATUS_RESUMED : before[slot] & RP_STATUS_RESUMED));
                const std::pair<uint64_t, uint32_t> now(uint64_t{block_of_[slot]} * block_scale(blocks, RP_BUNDLES) >> 32, slot);
                falls += now < last ? 1 : 0;
                last = now;
            }
            EXPECT_LT(falls, work_items);
            listed.insert(listed.end(), list->begin(), list->end());
        }
        return listed;
    }

    std::unique_ptr<Device> device_;
    std::mt19937 random_;
    std::vector<uint32_t> status_ = std::vector<uint32_t>(2 * RP_STATUS_WORDS(slots)), block_of_ = std::vector<uint32_t>(slots),
                          kept_ = std::vector<uint32_t>(slots);
    std::vector<rp_page> pages_ = std::vector<rp_page>(blocks);
    std::set<uint32_t> came_;  // blocks since the round before that are still there

private:
    void launch(bool named) {
        auto begin = device_->kernel({"stream/wake", "rp_begin_round", ""}), wake = device_->kernel({"stream/wake", "rp_wake_stream", ""});
        ASSERT_TRUE(begin.ok()) << begin.status().message();
        ASSERT_TRUE(wake.ok()) << wake.status().message();
        std::array<cl_uint, RP_MAX_NAMED> names{};
        rp_page_changes changes;
        for (rp_page& page : changes.pages) page.block = RP_NONE;
        // Where blocks are named, the table is changed with them.
        named = named && came_.size() <= names.size();
        uint32_t changed = 0;
        for (uint32_t block = 0; block < blocks; block++) {
            if (pages_on_device_[block].address == pages_[block].address) continue;
            if (named && changed < RP_PAGE_CHANGES) {
                changes.pages[changed] = pages_[block];
                changes.pages[changed++].block = block;
            } else {
                pages_on_device_[block] = pages_[block];
            }
        }
        if (named) std::copy(came_.begin(), came_.end(), names.begin());
        const cl_uint count = named ? static_cast<cl_uint>(came_.size()) : RP_NONE;
        // What is counted anew in each round is cleared.
        for (uint32_t i = 0; i < RP_COUNTERS_PER_ROUND; i++) counters_[i] = random_();
        const std::vector<uint32_t> before = demand_;
        std::fill_n(demand_.begin() + RP_DEMAND_MARKS_AT(blocks), RP_MARK_WORDS(blocks), 0);
        auto status = device_->upload(bytes_of(status_), "status"), pages = device_->upload(bytes_of(pages_on_device_), "pages");
        auto awake = device_->upload(bytes_of(awake_), "awake"), counters = device_->upload(bytes_of(counters_), "counters");
        auto demand = device_->upload(bytes_of(demand_), "demand");
        auto queue = device_->allocate(queue_.size() * sizeof(uint32_t), "queue"), free = device_->allocate(slots * sizeof(uint32_t), "free slots");
        Queue& commands = device_->kernels();
        ASSERT_TRUE(begin->set(*status, *pages, blocks, slots, *awake, *counters, *demand, count, names, changes).ok());
        // Several share the lists of a block, unequally, where there are more of them than blocks.
        const uint32_t most = named ? 100 : 5 * blocks;
        ASSERT_TRUE(commands.launch(*begin, random_() % 2 ? 1 + random_() % most : work_items, 1).ok());
        ASSERT_TRUE(wake->set(*status, slots, *awake, *queue, *free, *counters, block_scale(blocks, RP_BUNDLES)).ok());
        ASSERT_TRUE(commands.launch(*wake, work_items, 1).ok());
        const auto read = [&](const Buffer& buffer, auto& words) {
            ASSERT_TRUE(commands.read_now(buffer, 0, std::as_writable_bytes(std::span(words))).ok());
        };
        read(*status, status_);
        read(*pages, pages_on_device_);
        read(*awake, awake_);
        read(*counters, counters_);
        read(*demand, demand_);
        read(*queue, queue_);
        read(*free, free_);
        for (uint32_t i = 0; i < RP_COUNTERS_PER_ROUND; i++) {
            const bool counted = i == RP_COUNT_EXTEND || i == RP_COUNT_SHADOW || i == RP_COUNT_FREE;
            ASSERT_LE(counters_[i], counted ? slots : 0u) << i;
        }
        for (uint32_t block = 0; block < blocks; block++) {
            ASSERT_EQ(pages_on_device_[block].address, pages_[block].address);
            ASSERT_EQ(pages_on_device_[block].block, 0u);
            // The host is told where fewer wait than before.
            const uint32_t marks = demand_[RP_DEMAND_MARKS_AT(blocks) + block / (4 * RP_MARK_BLOCKS)];
            const bool marked = (marks >> 8 * (block / RP_MARK_BLOCKS % 4) & 255) != 0;
            const uint32_t at = RP_DEMAND_REQUESTS * blocks + block;
            ASSERT_TRUE(marked || demand_[at] == before[at]) << block;
        }
    }

    std::vector<rp_page> pages_on_device_ = std::vector<rp_page>(blocks);
    std::vector<uint32_t> demand_ = std::vector<uint32_t>(RP_DEMAND_WORDS_OF_STREAMS(blocks)), counters_ = std::vector<uint32_t>(RP_COUNTER_WORDS);
    std::vector<uint64_t> awake_ = std::vector<uint64_t>(RP_AWAKE_WORDS(slots), ~uint64_t{0});
    std::vector<uint32_t> queue_ = std::vector<uint32_t>(slots + work_items), free_ = std::vector<uint32_t>(slots);
};

// Blocks come and go, also without having been seen; paths begin, wait, go on and end.
TEST_F(WakeStream, nobody_is_forgotten_or_listed_twice) {
    const uint32_t seed = std::random_device{}();
    SCOPED_TRACE(seed);
    random_.seed(seed);
    uint32_t most_waiting = 0, left_free = 0, woken = 0;
    for (uint32_t round = 0; round < 300; round++) {
        SCOPED_TRACE(round);
        came_.clear();
        for (uint32_t n = random_() % (round % 20 == 19 ? 200 : 30); n > 0; n--) {
            const auto block = static_cast<uint32_t>(random_() % blocks);
            if (absent(block)) came_.insert(block);
            pages_[block].address = block;
            const auto leaves = static_cast<uint32_t>(random_() % blocks);
            pages_[leaves].address = RP_NONE;
            came_.erase(leaves);
        }
        std::vector<bool> waited(slots);
        for (uint32_t slot = 0; slot < slots; slot++) waited[slot] = waits(slot);
        most_waiting = std::max(most_waiting, static_cast<uint32_t>(std::count(waited.begin(), waited.end(), true)));
        const std::vector<uint32_t> listed = wake(round % 2 == 0);
        ASSERT_FALSE(HasFailure());
        for (const uint32_t slot : listed) {
            woken += waited[slot] ? 1 : 0;
            const auto block = static_cast<uint32_t>(random_() % blocks);
            if (phase(slot) == RP_PHASE_FREE && random_() % 8 == 0) {
                // No sample is left, or none in this round.
                if (round > 250) set(slot, RP_PHASE_IDLE, block);
                left_free++;
                continue;
            }
            const uint32_t others[] = {RP_PHASE_FREE, RP_PHASE_EXTEND, RP_PHASE_SHADOW};
            const bool stops = absent(block) && random_() % 8 != 0;
            set(slot, stops ? RP_PHASE_EXTEND_WAITS + random_() % 2 : others[random_() % 3], block);
        }
    }
    EXPECT_GT(woken, slots);
    EXPECT_GT(most_waiting, slots / 2);
    EXPECT_GT(left_free, 0u);
}

// Many rays of each block, so that bundles are long.
TEST_F(WakeStream, rays_of_a_block_stand_together) {
    const uint32_t seed = std::random_device{}();
    SCOPED_TRACE(seed);
    random_.seed(seed);
    for (uint32_t slot = 0; slot < slots; slot++)
        set(slot, random_() % 4 == 0 ? RP_PHASE_EXTEND_WAITS + random_() % 2 : RP_PHASE_EXTEND + random_() % 2, random_() % 7 * 40);
    for (rp_page& page : pages_) page.address = 0;
    EXPECT_EQ(wake(false).size(), slots);
}

// More slots than one work-item finds at once.
TEST_F(WakeStream, one_work_item_sees_to_all_slots) {
    constexpr uint32_t many = 200'003;
    auto wake = device_->kernel({"stream/wake", "rp_wake_stream", ""});
    ASSERT_TRUE(wake.ok()) << wake.status().message();
    std::vector<uint32_t> status(2 * RP_STATUS_WORDS(many)), counters(RP_COUNTER_WORDS), listed(many), unused(many);
    std::vector<uint64_t> awake(RP_AWAKE_WORDS(many), ~uint64_t{0});
    awake.back() >>= RP_AWAKE_SLOTS - many % RP_AWAKE_SLOTS;
    for (uint32_t slot = 0; slot < many; slot++) status[slot] = slot % 3 == 0 ? RP_PHASE_FREE : RP_PHASE_EXTEND;
    auto states = device_->upload(bytes_of(status), "status"), bits = device_->upload(bytes_of(awake), "awake");
    auto counts = device_->upload(bytes_of(counters), "counters");
    auto queue = device_->allocate((many + 1) * sizeof(uint32_t), "queue"), free = device_->allocate(many * sizeof(uint32_t), "free slots");
    ASSERT_TRUE(wake->set(*states, many, *bits, *queue, *free, *counts, block_scale(blocks, RP_BUNDLES)).ok());
    Queue& commands = device_->kernels();
    ASSERT_TRUE(commands.launch(*wake, 1, 1).ok());
    ASSERT_TRUE(commands.read_now(*counts, 0, std::as_writable_bytes(std::span(counters))).ok());
    ASSERT_TRUE(commands.read_now(*queue, 0, std::as_writable_bytes(std::span(listed))).ok());
    ASSERT_TRUE(commands.read_now(*free, 0, std::as_writable_bytes(std::span(unused))).ok());
    ASSERT_EQ(counters[RP_COUNT_FREE], (many + 2) / 3);
    ASSERT_EQ(counters[RP_COUNT_EXTEND], many - (many + 2) / 3);
    listed.resize(counters[RP_COUNT_EXTEND]);
    unused.resize(counters[RP_COUNT_FREE]);
    std::sort(listed.begin(), listed.end());
    std::sort(unused.begin(), unused.end());
    for (uint32_t i = 0; i < unused.size(); i++) ASSERT_EQ(unused[i], 3 * i);
    for (uint32_t i = 0; i < listed.size(); i++) ASSERT_EQ(listed[i], 3 * (i / 2) + 1 + i % 2);
}

// Many work-items at once, all into the same lists: every slot is in one, and is counted.
TEST(WaitingLists, nobody_is_lost_where_all_come_at_once) {
    if (support::traversals().size() == 1) GTEST_SKIP() << "this device does not trace in streams";
    const uint32_t seed = std::random_device{}();
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    auto device = Device::open("", 0);
    ASSERT_TRUE(device.ok()) << device.status().message();
    auto kernel = support::probe_kernel(**device, "stream/probe", "rp_probe_chains", "-DRP_SLABS=1 -DRP_STACK_SIZE=96");
    ASSERT_TRUE(kernel.ok()) << kernel.status().message();
    constexpr uint32_t items = 512, slots = items * 64;
    for (uint32_t block_count = 1; block_count <= 20; block_count++) {
        SCOPED_TRACE(block_count);
        const bool shadow = block_count % 2 == 0;
        std::vector<uint32_t> blocks(slots), status(2 * RP_STATUS_WORDS(slots)), demand(RP_DEMAND_WORDS_OF_STREAMS(block_count));
        for (uint32_t& block : blocks) block = random() % block_count;
        auto waits_for = (*device)->upload(bytes_of(blocks), "blocks"), states = (*device)->upload(bytes_of(status), "status");
        auto lists = (*device)->upload(bytes_of(demand), "demand");
        ASSERT_TRUE(kernel->set(*waits_for, block_count, slots, uint32_t{shadow}, *states, *lists).ok());
        Queue& commands = (*device)->kernels();
        ASSERT_TRUE(commands.launch(*kernel, items, 1).ok());
        ASSERT_TRUE(commands.read_now(*states, 0, std::as_writable_bytes(std::span(status))).ok());
        ASSERT_TRUE(commands.read_now(*lists, 0, std::as_writable_bytes(std::span(demand))).ok());
        std::vector<bool> found(slots);
        for (uint32_t block = 0; block < block_count; block++) {
            uint32_t length = 0;
            for (uint32_t list = 0; list < 2 * RP_LISTS; list++) {
                uint32_t link = demand[RP_DEMAND_LISTS_AT(block_count) + 2 * RP_LISTS * block + list];
                EXPECT_EQ(link != 0, list == 3 + (shadow ? RP_LISTS : 0)) << list;
                for (; link != 0; link = status[RP_STATUS_WORDS(slots) + link - 1], length++) {
                    ASSERT_LE(link, slots);
                    ASSERT_FALSE(found[link - 1]) << "slot " << link - 1 << " twice";
                    ASSERT_EQ(blocks[link - 1], block);
                    found[link - 1] = true;
                }
            }
            EXPECT_EQ(length, std::count(blocks.begin(), blocks.end(), block));
            EXPECT_EQ(demand[RP_DEMAND_REQUESTS * block_count + block], length);
            EXPECT_EQ(demand[RP_DEMAND_MARKS_AT(block_count)] >> 8 * (block / RP_MARK_BLOCKS) & 255, length > 0 ? 1u : 0u);
        }
        EXPECT_EQ(std::count(found.begin(), found.end(), true), slots);
        EXPECT_EQ(std::count(status.begin(), status.begin() + slots, RP_PHASE_EXTEND_WAITS), slots);
    }
}

}  // namespace
}  // namespace raypager
