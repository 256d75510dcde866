// The first stage of a round, beside rays traced one by one, against the rule in plain C++: which slots can go on, which wait, which are free.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <random>
#include <set>
#include <span>
#include <string>

#include "device/device.hpp"
#include "raypager/abi/block.h"
#include "raypager/abi/path.h"
#include "wavefront/sleep_groups.hpp"

namespace raypager {
namespace {

constexpr uint32_t slots = 5003, blocks = 297;  // not a multiple of anything

// What the stage finds on the device.
struct Slots {
    std::vector<uint32_t> status = std::vector<uint32_t>(2 * RP_STATUS_WORDS(slots));  // abi/path.h
    std::vector<rp_page> pages = std::vector<rp_page>(blocks);
    std::vector<uint32_t> came;  // since the round before
};

struct Lists {
    std::set<uint32_t> extend, shadow, free;
    uint32_t waiting = 0;
    bool operator==(const Lists&) const = default;
};

// Runs of slots in the same state, some as long as what is looked at together. Who waits, waits for a block that was absent until now.
Slots random_slots(std::mt19937& random, uint32_t new_blocks) {
    Slots s;
    std::vector<uint32_t> absent;
    for (uint32_t block = 0; block < blocks; block++) {
        s.pages[block] = {random() % 4 == 0 ? block : RP_NONE, 0, 0, 0};
        if (s.pages[block].address == RP_NONE) absent.push_back(block);
    }
    for (uint32_t slot = 0; slot < slots;) {
        const uint32_t phases[] = {RP_PHASE_FREE, RP_PHASE_EXTEND, RP_PHASE_SHADOW, RP_PHASE_IDLE, RP_PHASE_EXTEND_WAITS, RP_PHASE_SHADOW_WAITS};
        const uint32_t phase = phases[random() % 6], block = absent[random() % absent.size()];
        for (const uint32_t end = std::min<uint32_t>(slots, slot + 1 + random() % (random() % 2 ? 3 : 60)); slot < end; slot++) {
            const bool first = (phase == RP_PHASE_EXTEND || phase == RP_PHASE_SHADOW) && random() % 2;
            s.status[slot] = phase | static_cast<uint32_t>(random() % 200) << RP_STATUS_OFFSET_SHIFT | (first ? RP_STATUS_FIRST : 0);
            s.status[RP_STATUS_WORDS(slots) + slot] = random() % 8 ? block : absent[random() % absent.size()];
        }
    }
    std::shuffle(absent.begin(), absent.end(), random);
    s.came.assign(absent.begin(), absent.begin() + new_blocks);
    for (const uint32_t block : s.came) s.pages[block].address = block;
    if (!s.came.empty()) s.pages[s.came[0]].address = RP_NONE;  // came, and left again before anybody saw it
    return s;
}

// together: so many free slots are given out together or not at all.
Lists expected(const Slots& s, uint32_t together) {
    Lists lists;
    const auto unused = [&](uint32_t slot) {
        const uint32_t phase = s.status[slot] & RP_PHASE_MASK;
        return phase == RP_PHASE_FREE || phase == RP_PHASE_IDLE;
    };
    const auto kept = [&](uint32_t slot) {
        const uint32_t first = slot / together * together;
        for (uint32_t other = first; other < std::min(first + together, slots); other++)
            if (!unused(other)) return true;
        return false;
    };
    for (uint32_t slot = 0; slot < slots; slot++) {
        const uint32_t phase = s.status[slot] & RP_PHASE_MASK;
        const bool waits = phase == RP_PHASE_EXTEND_WAITS || phase == RP_PHASE_SHADOW_WAITS;
        if (waits && s.pages[s.status[RP_STATUS_WORDS(slots) + slot]].address == RP_NONE)
            lists.waiting++;
        else if (phase != RP_PHASE_IDLE && (phase != RP_PHASE_FREE || !kept(slot)))
            (phase == RP_PHASE_FREE                                       ? lists.free
             : phase == RP_PHASE_SHADOW || phase == RP_PHASE_SHADOW_WAITS ? lists.shadow
                                                                          : lists.extend)
                .insert(slot);
    }
    return lists;
}

// Rays from first vertices come before the others that the same work-group lists; it lists them in one piece.
void expect_first_ones_first(const Slots& s, std::span<const uint32_t> listed, uint32_t slots_a_group) {
    std::set<uint32_t> ended, seen_others;
    for (size_t i = 0; i < listed.size(); i++) {
        const uint32_t group = listed[i] / slots_a_group;
        if (i > 0 && listed[i - 1] / slots_a_group != group) ended.insert(listed[i - 1] / slots_a_group);
        EXPECT_FALSE(ended.count(group)) << "in two pieces";
        const bool first = (s.status[listed[i]] & RP_STATUS_FIRST) != 0;
        EXPECT_FALSE(first && seen_others.count(group)) << "slot " << listed[i];
        if (!first) seen_others.insert(group);
    }
}

// So many free slots are given out together.
class Wake : public testing::TestWithParam<uint32_t> {
protected:
    void SetUp() override {
        auto device = Device::open("", 0);
        ASSERT_TRUE(device.ok()) << device.status().message();
        device_ = std::move(*device);
        SetUpNaps();
    }

    void SetUpNaps() {
        auto buffer = device_->allocate((slots + RP_SLEEP_GROUP - 1) / RP_SLEEP_GROUP * sizeof(uint64_t), "sleeping groups");
        ASSERT_TRUE(buffer.ok());
        sleep_groups_ = std::move(*buffer);
    }

    // named: whether it is told which blocks came. Slots that slept after the last call may sleep on.
    Lists wake(const Slots& s, bool named) { return wake(s, named, GetParam()); }
    Lists wake(const Slots& s, bool named, uint32_t together) {
        auto kernel =
            device_->kernel({"single_ray/wake", "rp_wake", fmt::format("-DRP_WAKE_GROUP={} -DRP_WAKE_SLEEP_GROUPS=3", device_->group_size())});
        EXPECT_TRUE(kernel.ok()) << kernel.status().message();
        auto status = device_->upload(bytes_of(s.status), "status"), pages = device_->upload(bytes_of(s.pages), "pages");
        auto queue = device_->allocate(slots * sizeof(uint32_t), "queue"), free_list = device_->allocate(slots * sizeof(uint32_t), "free slots");
        auto counters = device_->allocate(RP_COUNTER_WORDS * sizeof(uint32_t), "counters");
        const uint32_t bit_scale = sleep_bit_scale(blocks);
        const cl_ulong came = named ? sleep_bits(s.came, bit_scale) : all_sleep_bits;
        Queue& commands = device_->kernels();
        EXPECT_TRUE(kernel->set(*status, *pages, slots, *queue, *free_list, *counters, sleep_groups_, bit_scale, came, together).ok());
        EXPECT_TRUE(commands.launch(*kernel, ((slots + RP_SLEEP_GROUP - 1) / RP_SLEEP_GROUP + 2) / 3, device_->group_size()).ok());
        std::vector<uint32_t> queued(slots), listed(slots), counts(RP_COUNTER_WORDS);
        EXPECT_TRUE(commands.read_now(*queue, 0, std::as_writable_bytes(std::span(queued))).ok());
        EXPECT_TRUE(commands.read_now(*free_list, 0, std::as_writable_bytes(std::span(listed))).ok());
        EXPECT_TRUE(commands.read_now(*counters, 0, std::as_writable_bytes(std::span(counts))).ok());
        const uint32_t slots_a_group = RP_SLEEP_GROUP * 3 * device_->group_size();
        expect_first_ones_first(s, std::span(queued).first(counts[RP_COUNT_EXTEND]), slots_a_group);
        expect_first_ones_first(s, std::vector<uint32_t>(queued.rbegin(), queued.rbegin() + counts[RP_COUNT_SHADOW]), slots_a_group);
        Lists lists;
        lists.extend.insert(queued.begin(), queued.begin() + counts[RP_COUNT_EXTEND]);
        lists.shadow.insert(queued.rbegin(), queued.rbegin() + counts[RP_COUNT_SHADOW]);
        lists.free.insert(listed.begin(), listed.begin() + counts[RP_COUNT_FREE]);
        EXPECT_EQ(lists.extend.size() + lists.shadow.size() + lists.free.size(),
                  counts[RP_COUNT_EXTEND] + counts[RP_COUNT_SHADOW] + counts[RP_COUNT_FREE]);
        lists.waiting = counts[RP_COUNT_WAITING];
        return lists;
    }

    std::unique_ptr<Device> device_;
    Buffer sleep_groups_;
};

TEST_P(Wake, lists_every_slot_once_where_it_belongs) {
    const uint32_t seed = std::random_device{}();
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    for (const uint32_t new_blocks : {0u, 1u, 3u, 16u, 40u}) {
        SCOPED_TRACE(new_blocks);
        const Slots s = random_slots(random, new_blocks);
        const Lists right = expected(s, GetParam());
        EXPECT_GT(right.waiting, 0u);
        SetUpNaps();  // nobody sleeps
        EXPECT_TRUE(wake(s, false) == right);
        SetUpNaps();
        EXPECT_TRUE(wake(s, true) == right);
    }
}

// Round after round of a render in small: blocks come and go, slots that can go on end up anywhere, and those that slept are not forgotten.
TEST_P(Wake, nobody_sleeps_too_long) {
    const uint32_t seed = std::random_device{}();
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    Slots s = random_slots(random, 0);
    const auto absent = [&](uint32_t block) { return s.pages[block].address == RP_NONE; };
    uint32_t woken = 0, most_waiting = 0;
    for (uint32_t round = 0; round < 200; round++) {
        SCOPED_TRACE(round);
        // A ray stops at a block that is absent in this round; all that came since are named in the next, or nothing is known.
        s.came.clear();
        for (uint32_t n = random() % (round % 20 == 19 ? 30 : 4); n > 0; n--) {
            const auto block = static_cast<uint32_t>(random() % blocks), gone = static_cast<uint32_t>(random() % blocks);
            if (absent(block)) s.came.push_back(block);
            s.pages[block].address = block;
            s.pages[gone].address = RP_NONE;
        }
        const Lists right = expected(s, GetParam());
        ASSERT_TRUE(wake(s, round % 50 != 49) == right);
        woken += static_cast<uint32_t>(right.extend.size() + right.shadow.size());
        most_waiting = std::max(most_waiting, right.waiting);
        for (const auto* list : {&right.extend, &right.shadow, &right.free})
            for (const uint32_t slot : *list) {
                const auto block = static_cast<uint32_t>(random() % blocks);
                const bool waits = absent(block) && random() % 8 != 0;
                const uint32_t others[] = {RP_PHASE_FREE, RP_PHASE_EXTEND, RP_PHASE_SHADOW};
                s.status[slot] = waits                              ? RP_PHASE_EXTEND_WAITS + random() % 2
                                 : round > 150 && random() % 4 == 0 ? RP_PHASE_IDLE
                                                                    : others[random() % 3];
                s.status[RP_STATUS_WORDS(slots) + slot] = block;
            }
    }
    EXPECT_GT(woken, slots);
    EXPECT_GT(most_waiting, slots / 2);
}

TEST_P(Wake, nobody_is_lost_where_it_changes_how_many_are_given_out_together) {
    const uint32_t seed = std::random_device{}();
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    Slots s = random_slots(random, 0);
    for (const uint32_t together : {GetParam(), 8u, 1u, 4u, 2u}) {
        const Lists lists = wake(s, true, together), right = expected(s, together);
        EXPECT_TRUE(lists.extend == right.extend && lists.shadow == right.shadow && lists.waiting == right.waiting) << together;
        EXPECT_TRUE(std::includes(right.free.begin(), right.free.end(), lists.free.begin(), lists.free.end())) << together;
    }
    for (uint32_t block = 0; block < blocks; block++) {
        if (s.pages[block].address == RP_NONE) s.came.push_back(block);
        s.pages[block].address = block;
    }
    EXPECT_TRUE(wake(s, true) == expected(s, GetParam()));
}

// The names are what it goes by: a block that has come and is not named wakes nobody who sleeps.
TEST_P(Wake, only_named_blocks_wake_where_all_wait) {
    constexpr uint32_t other = blocks / 2;  // far from block 0: they do not share a bit
    Slots s;
    for (uint32_t slot = 0; slot < slots; slot++) {
        s.status[slot] = RP_PHASE_EXTEND_WAITS;
        s.status[RP_STATUS_WORDS(slots) + slot] = slot / 64 % 2 * other;
    }
    s.pages.assign(blocks, rp_page{RP_NONE, 0, 0, 0});
    EXPECT_EQ(wake(s, true).waiting, slots);  // they fall asleep
    s.pages.assign(blocks, rp_page{0, 0, 0, 0});
    s.came = {other};
    const Lists lists = wake(s, true);
    EXPECT_TRUE(lists.extend.contains(64) && lists.extend.contains(127));
    EXPECT_FALSE(lists.extend.contains(0) || lists.extend.contains(63));
    EXPECT_EQ(lists.waiting + lists.extend.size(), slots);
}

TEST(SleepGroups, every_block_has_a_bit_below_the_count) {
    for (const uint32_t count : {1u, 2u, 57u, 58u, 59u, 116u, 297u, 1303u, 1u << 20, RP_NONE}) {
        SCOPED_TRACE(count);
        const uint32_t scale = sleep_bit_scale(count), last = count - 1;
        EXPECT_EQ(sleep_bits(std::span(&last, 1), scale) & ~all_sleep_bits, 0u);
        uint64_t all = 0;
        for (uint32_t i = 0; i < std::min(count, 5000u); i++) {
            const auto block = static_cast<uint32_t>(uint64_t{i} * last / std::max(std::min(count, 5000u) - 1, 1u));
            all |= sleep_bits(std::span(&block, 1), scale);
        }
        EXPECT_GE(std::popcount(all), std::min<int>(static_cast<int>(count) - 1, RP_SLEEP_BITS - 1));
        EXPECT_EQ(all & ~all_sleep_bits, 0u);
    }
}

INSTANTIATE_TEST_SUITE_P(together, Wake, testing::Values(1u, 2u, 4u, 8u), [](const auto& together) { return std::to_string(together.param); });

}  // namespace
}  // namespace raypager
