// What a round tells the host (kernels/common/report.cl), against the rule in plain C++.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "device/device.hpp"
#include "raypager/abi/block.h"
#include "raypager/abi/path.h"
#include "raypager/abi/scene.h"
#include "support/device_scene.hpp"
#include "wavefront/round_reports.hpp"

namespace raypager {
namespace {

bool by_block(const rp_block_demand& a, const rp_block_demand& b) { return a.block < b.block; }
bool operator==(const rp_block_demand& a, const rp_block_demand& b) {
    return a.block == b.block && a.requests == b.requests && a.bounces == b.bounces && a.used == b.used;
}

class Report : public testing::Test {
protected:
    void SetUp() override {
        auto device = Device::open("", 0);
        ASSERT_TRUE(device.ok()) << device.status().message();
        device_ = std::move(*device);
        auto kernel = device_->kernel({"single_ray/publish", "rp_report", " -DRP_TRACK_BOUNCES"});
        ASSERT_TRUE(kernel.ok()) << kernel.status().message();
        kernel_ = std::move(*kernel);
    }
    void use(uint32_t blocks, uint32_t at_once) {
        blocks_ = blocks;
        round_ = 0;
        words_.assign(RP_DEMAND_WORDS(size_t{blocks}) + 1, 0);
        words_.back() = 0x12345678u;  // nothing may change behind the end
        counters_.assign(RP_COUNTER_WORDS, 0);
        auto demand = device_->upload(bytes_of(words_), "demand"), counters = device_->upload(bytes_of(counters_), "counters");
        ASSERT_TRUE(demand.ok() && counters.ok());
        demand_ = std::move(*demand);
        counters_on_device_ = std::move(*counters);
        reports_ = RoundReports();
        ASSERT_TRUE(reports_.allocate(*device_, blocks, at_once).ok());
    }
    uint32_t& word(uint32_t array, uint32_t block) { return words_[array * size_t{blocks_} + block]; }
    void mark(uint32_t block) {
        const uint32_t mark = block / RP_MARK_BLOCKS;
        words_[RP_DEMAND_MARKS_AT(size_t{blocks_}) + mark / 4] |= 1u << 8 * (mark % 4);
    }
    // The end of a round, and what the host gets of it, by block.
    std::vector<rp_block_demand> report(uint32_t items, uint32_t together) {
        const uint32_t number = round_++ % RoundReports::count;
        Queue& queue = device_->kernels();
        std::vector<rp_block_demand> told;
        RoundCounters counters;
        std::span<const rp_block_demand> demand;
        const auto steps = [&]() -> Status {
            RAYPAGER_TRY(kernel_.set(counters_on_device_, demand_, blocks_, reports_.buffer(), number, together));
            RAYPAGER_TRY(queue.launch(kernel_, items, 1));
            RAYPAGER_TRY(reports_.begin_read(number));
            return reports_.finish_read(number, counters, demand);
        };
        const Status done = steps();
        EXPECT_TRUE(done) << done.message();
        EXPECT_TRUE(std::equal(counters.words.begin(), counters.words.end(), counters_.begin()));
        told.assign(demand.begin(), demand.end());
        std::sort(told.begin(), told.end(), by_block);
        return told;
    }
    // The same by the rule, with what it leaves behind.
    std::vector<rp_block_demand> expected() {
        std::vector<rp_block_demand> told;
        for (uint32_t block = 0; block < blocks_; block++) {
            const uint32_t mark = block / RP_MARK_BLOCKS;
            if ((words_[RP_DEMAND_MARKS_AT(size_t{blocks_}) + mark / 4] >> 8 * (mark % 4) & 255) == 0) continue;
            uint32_t* const last = &words_[RP_DEMAND_TOLD_AT(size_t{blocks_}) + 2 * size_t{block}];
            const rp_block_demand now = {block, word(RP_DEMAND_REQUESTS, block), word(RP_DEMAND_BOUNCES, block), word(RP_DEMAND_USED, block)};
            if (now.requests == last[0] && now.bounces == 0 && now.used == last[1]) continue;
            told.push_back(now);
            last[0] = now.requests;
            last[1] = now.used;
            word(RP_DEMAND_BOUNCES, block) = 0;
        }
        std::fill_n(words_.begin() + static_cast<std::ptrdiff_t>(RP_DEMAND_MARKS_AT(size_t{blocks_})), RP_MARK_WORDS(blocks_), 0);
        return told;
    }
    void write() {
        ASSERT_TRUE(device_->kernels().write_now(demand_, 0, bytes_of(words_)).ok());
        ASSERT_TRUE(device_->kernels().write_now(counters_on_device_, 0, bytes_of(counters_)).ok());
    }
    std::vector<uint32_t> left_behind() {
        std::vector<uint32_t> words(words_.size());
        EXPECT_TRUE(device_->kernels().read_now(demand_, 0, std::as_writable_bytes(std::span(words))).ok());
        return words;
    }

    std::unique_ptr<Device> device_;
    Kernel kernel_;
    uint32_t blocks_ = 0, round_ = 0;
    std::vector<uint32_t> words_, counters_;
    Buffer demand_, counters_on_device_;
    RoundReports reports_;
};

TEST_F(Report, tells_what_has_changed_and_nothing_else) {
    const uint32_t seed = std::random_device{}();
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    const auto below = [&](uint32_t n) { return n == 0 ? 0 : static_cast<uint32_t>(random() % n); };
    size_t longest = 0;
    for (const uint32_t blocks : {0u, 1u, 7u, 8u, 9u, 31u, 32u, 33u, 64u, 1000u, 5003u}) {
        const uint32_t at_once = below(2) ? 4096 : 1 + below(20);
        use(blocks, at_once);
        for (uint32_t round = 0; round < 12; round++) {
            SCOPED_TRACE(testing::Message() << blocks << " blocks, round " << round);
            for (uint32_t& counter : counters_) counter = random();
            // Some change, some are marked all the same; the first round tells of most, and some of nobody.
            const uint32_t most = round == 0 ? 2 * blocks : below(round % 2 ? 2 * blocks : 1 + blocks / 10);
            const uint32_t changes = blocks == 0 || round % 4 == 3 ? 0 : most;
            for (uint32_t i = 0; i < changes; i++) {
                const uint32_t block = below(blocks), array = below(4);
                if (array < RP_DEMAND_ARRAYS) word(array, block) = below(3) ? random() : 0;
                mark(block);
            }
            write();
            const std::vector<rp_block_demand> told = report(1 + below(100), 1 + below(40)), rule = expected();
            ASSERT_EQ(told.size(), rule.size());
            ASSERT_TRUE(std::equal(told.begin(), told.end(), rule.begin(), [](const auto& a, const auto& b) { return a == b; }));
            ASSERT_EQ(left_behind(), words_);
            longest = std::max(longest, told.size());
        }
    }
    EXPECT_GT(longest, 1000u);
}

// More than are read at once, while the next round is under way already: none is lost, and more are read at once from then on.
TEST_F(Report, what_is_not_read_at_once_is_read_afterwards) {
    use(20'000, 100);
    Queue& queue = device_->kernels();
    for (uint32_t block = 0; block < blocks_; block++) word(RP_DEMAND_USED, block) = block + 1, mark(block);
    write();
    ASSERT_TRUE(kernel_.set(counters_on_device_, demand_, blocks_, reports_.buffer(), 0u, 1u).ok());
    ASSERT_TRUE(queue.launch(kernel_, 64, 1).ok());
    ASSERT_TRUE(reports_.begin_read(0).ok());
    // Nothing has changed in the next one.
    ASSERT_TRUE(kernel_.set(counters_on_device_, demand_, blocks_, reports_.buffer(), 1u, 1u).ok());
    ASSERT_TRUE(queue.launch(kernel_, 64, 1).ok());
    ASSERT_TRUE(reports_.begin_read(1).ok());
    RoundCounters counters;
    std::span<const rp_block_demand> demand;
    ASSERT_TRUE(reports_.finish_read(0, counters, demand).ok());
    ASSERT_EQ(demand.size(), blocks_);
    std::vector<rp_block_demand> told(demand.begin(), demand.end());
    std::sort(told.begin(), told.end(), by_block);
    for (uint32_t block = 0; block < blocks_; block++) ASSERT_TRUE(told[block] == (rp_block_demand{block, 0, 0, block + 1}));
    ASSERT_TRUE(reports_.finish_read(1, counters, demand).ok());
    EXPECT_TRUE(demand.empty());
}

TEST_F(Report, what_was_much_once_is_not_read_for_ever) {
    use(20'000, 100);
    for (uint32_t block = 0; block < blocks_; block++) word(RP_DEMAND_USED, block) = block + 1, mark(block);
    write();
    ASSERT_EQ(report(64, 1).size(), blocks_);
    EXPECT_EQ(reports_.at_once(), blocks_);
    expected();
    for (uint32_t round = 0; round < RoundReports::rounds_to_forget; round++) {
        word(RP_DEMAND_USED, 7) = round + 100;
        mark(7);
        write();
        ASSERT_EQ(report(1, 1).size(), 1u);
        expected();
        ASSERT_TRUE(reports_.at_once() == blocks_ || round >= RoundReports::rounds_to_forget / 2) << "forgotten too soon";
    }
    for (uint32_t round = 0; round < RoundReports::rounds_to_forget; round++) ASSERT_TRUE(report(1, 1).empty());
    EXPECT_EQ(reports_.at_once(), 100u);
}

// With single rays: whose block has come goes on in that round, so requests end with the change of the page table, or, where the table was written as
// a whole, with the stage that asks all blocks.
TEST_F(Report, nobody_waits_for_what_has_come) {
    use(500, 4096);
    auto publish = device_->kernel({"single_ray/publish", "rp_publish", " -DRP_TRACK_BOUNCES"});
    auto advance = device_->kernel({"single_ray/generate", "rp_advance", ""});
    ASSERT_TRUE(publish.ok() && advance.ok());
    std::vector<rp_page> pages(blocks_, rp_page{RP_NONE, 0, 0, 0});
    const auto is_there = [](uint32_t block) { return block % 3 == 0; };
    for (uint32_t block = 0; block < blocks_; block++) word(RP_DEMAND_REQUESTS, block) = block % 5, mark(block);
    write();
    (void)report(10, 4);
    (void)expected();
    auto table = device_->upload(bytes_of(pages), "pages");
    ASSERT_TRUE(table.ok());
    // These come or, the next block each, go.
    rp_page_changes changes;
    for (rp_page& page : changes.pages) page.block = RP_NONE;
    const std::vector<uint32_t> named = {0, 6, 9, 42, 303};
    for (size_t i = 0; i < named.size(); i++) {
        changes.pages[2 * i] = {7, 0, 0, named[i]};
        changes.pages[2 * i + 1] = {RP_NONE, 0, 0, named[i] + 1};
    }
    Queue& queue = device_->kernels();
    ASSERT_TRUE(publish->set(*table, blocks_, demand_, changes).ok());
    ASSERT_TRUE(queue.launch(*publish, 1, 1).ok());
    std::vector<rp_block_demand> rule;
    for (const uint32_t block : named)
        if (block % 5 != 0) rule.push_back({block, 0, 0, 0});
    std::vector<rp_block_demand> told = report(10, 4);
    ASSERT_EQ(told.size(), rule.size());
    for (size_t i = 0; i < told.size(); i++) EXPECT_TRUE(told[i] == rule[i]) << told[i].block;

    for (uint32_t block = 0; block < blocks_; block++) pages[block].address = is_there(block) ? block : RP_NONE;
    ASSERT_TRUE(queue.write_now(*table, 0, bytes_of(pages)).ok());
    rp_render_params params = {};
    auto settings = device_->upload(std::as_bytes(std::span(&params, 1)), "settings");
    ASSERT_TRUE(settings.ok());
    ASSERT_TRUE(advance->set(*settings, counters_on_device_, *table, blocks_, blocks_, demand_, rp_sample_numbers{}, 0u).ok());
    ASSERT_TRUE(queue.launch(*advance, blocks_, 1).ok());
    ASSERT_TRUE(queue.read_now(counters_on_device_, 0, std::as_writable_bytes(std::span(counters_))).ok());
    rule.clear();
    for (uint32_t block = 0; block < blocks_; block++)
        if (is_there(block) && block % 5 != 0 && std::find(named.begin(), named.end(), block) == named.end()) rule.push_back({block, 0, 0, 0});
    told = report(10, 4);
    ASSERT_EQ(told.size(), rule.size());
    for (size_t i = 0; i < told.size(); i++) EXPECT_TRUE(told[i] == rule[i]) << told[i].block;
}

}  // namespace
}  // namespace raypager
