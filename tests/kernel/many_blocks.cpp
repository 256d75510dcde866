// What paging costs in a round beside tracing, by the number of blocks and pages and by how many of them are active. Prints milliseconds.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <random>
#include <set>

#include "device/device.hpp"
#include "raypager/abi/path.h"
#include "residency/block_table.hpp"
#include "support/device_scene.hpp"
#include "support/probe_kernels.hpp"
#include "wavefront/round_reports.hpp"

namespace raypager {
namespace {

// Rays want some blocks of many, from round to round a few others: each round enters the resident ones, waits for others, and pages. The pool holds
// half of them, or more than are wanted.
class ManyBlocks {
public:
    static constexpr uint32_t block_bytes = 1 << 16;

    ManyBlocks(uint32_t blocks, uint32_t active, uint32_t resident)
        : blocks_(blocks),
          table_(std::vector<uint32_t>(blocks, block_bytes), SlabAllocator({uint64_t{resident} * block_bytes}), policy(resident)),
          waiting_(blocks) {
        fill(resident);
        std::set<uint32_t> chosen;
        while (chosen.size() < active) chosen.insert(any());
        active_.assign(chosen.begin(), chosen.end());
    }
    Status prepare(Device& device) {
        device_ = &device;
        auto raise = support::probe_kernel(device, "common/demand_probe", "rp_probe_demand", "");
        auto report = device.kernel({"single_ray/publish", "rp_report", ""});
        const std::vector<uint32_t> none(RP_DEMAND_WORDS(size_t{blocks_})), zero(RP_COUNTER_WORDS);
        auto demand = device.upload(bytes_of(none), "demand"), counters = device.upload(bytes_of(zero), "counters");
        if (!raise || !report || !demand || !counters) return Status::failed("cannot be prepared");
        raise_ = std::move(*raise), report_ = std::move(*report), demand_ = std::move(*demand), counters_ = std::move(*counters);
        return reports_.allocate(device, blocks_);
    }
    // A round. device, host: seconds.
    Status round(double& device_seconds, double& host_seconds) {
        using Clock = std::chrono::steady_clock;
        round_++;
        std::vector<rp_block_demand> items = trace();
        auto list = device_->upload(bytes_of(items), "items");
        if (!list) return list.status();
        Queue& queue = device_->kernels();
        RAYPAGER_TRY(raise_.set(*list, blocks_, demand_));
        RAYPAGER_TRY(queue.launch(raise_, items.size(), 1));
        RAYPAGER_TRY(queue.finish());
        const auto begin = Clock::now();
        RAYPAGER_TRY(report_.set(counters_, demand_, blocks_, reports_.buffer(), round_ % 2, 64u));
        RAYPAGER_TRY(queue.launch(report_, std::clamp(blocks_ / (64 * 32), 1u, device_->info().compute_units * 4), 1));
        RAYPAGER_TRY(reports_.begin_read(round_ % 2));
        std::span<const rp_block_demand> told;
        RoundCounters counters;
        RAYPAGER_TRY(reports_.finish_read(round_ % 2, counters, told));
        const auto read = Clock::now();
        table_.take_demand(round_, told);
        for (const uint32_t block : loading_) table_.arrive(round_, block);
        came_ = std::exchange(loading_, {});
        const Plan plan = table_.plan(round_, 0, 1 << 20);
        const auto end = Clock::now();
        for (const PlannedLoad& load : plan.load) loading_.push_back(load.block);
        device_seconds += std::chrono::duration<double>(read - begin).count();
        host_seconds += std::chrono::duration<double>(end - read).count();
        told_ += told.size();
        return {};
    }
    uint64_t told() const { return told_; }
    uint64_t evictions() const { return table_.statistics().evictions; }
    // As many rays wait for each block as have come to wait for it.
    void expect_known() const {
        for (uint32_t block = 0; block < blocks_; block++) ASSERT_EQ(table_.blocks()[block].requests, waiting_[block]) << block;
    }

private:
    static PolicySettings policy(uint32_t resident) {
        return default_settings(PolicyKind::aged_wants, uint64_t{resident} * block_bytes, block_bytes, profile_of_cores(2));
    }
    uint32_t any() { return static_cast<uint32_t>(random_() % blocks_); }
    // The pool, as rounds before these would have.
    void fill(uint32_t resident) {
        std::vector<rp_block_demand> wanted, had;
        for (uint32_t block = 0; block < resident; block++) wanted.push_back({block, 1, 0, 0}), had.push_back({block, 0, 0, 0});
        for (table_.take_demand(++round_, wanted); loading_.empty() || table_.resident_bytes() < table_.pool_bytes(); round_++) {
            const Plan plan = table_.plan(round_, 0, 1);
            loading_.clear();
            for (const PlannedLoad& load : plan.load) {
                loading_.push_back(load.block);
                table_.arrive(round_, load.block);
            }
            ASSERT_FALSE(plan.load.empty());
        }
        table_.take_demand(++round_, had);
        loading_.clear();
    }
    // Who waits for what came goes on; some of the active blocks are entered or waited for.
    std::vector<rp_block_demand> trace() {
        std::vector<rp_block_demand> items;
        for (const uint32_t block : came_) {
            items.push_back({block, 0u - waiting_[block], 0, 1});
            waiting_[block] = 0;
        }
        for (size_t i = 0; i < active_.size() / 50; i++) active_[random_() % active_.size()] = any();
        std::sort(active_.begin(), active_.end());
        active_.erase(std::unique(active_.begin(), active_.end()), active_.end());
        for (const uint32_t block : active_) {
            const bool there = table_.blocks()[block].state == PageState::resident;
            const auto rays = static_cast<uint32_t>(random_() % 100);
            if (std::find(came_.begin(), came_.end(), block) != came_.end() || rays == 0) continue;
            items.push_back({block, there ? 0 : rays, 0, there ? rays : 0});
            waiting_[block] += there ? 0 : rays;
        }
        return items;
    }

    const uint32_t blocks_;
    BlockTable table_;
    std::vector<uint32_t> waiting_, active_, loading_, came_;
    std::mt19937 random_{1};
    Device* device_ = nullptr;
    Kernel raise_, report_;
    Buffer demand_, counters_;
    RoundReports reports_;
    uint32_t round_ = 0;
    uint64_t told_ = 0;
};

class ManyBlocksOnDevice : public testing::Test {
protected:
    void SetUp() override {
        auto device = Device::open("", 0);
        ASSERT_TRUE(device.ok()) << device.status().message();
        device_ = std::move(*device);
    }
    void measure(uint32_t blocks, uint32_t active, uint32_t resident) {
        SCOPED_TRACE(testing::Message() << blocks << " blocks, " << active << " active, " << resident << " resident");
        constexpr uint32_t rounds = 40;
        ManyBlocks scene(blocks, active, resident);
        ASSERT_TRUE(scene.prepare(*device_).ok());
        std::vector<double> device_ms, host_ms;
        for (uint32_t round = 0; round < rounds; round++) {
            double on_device = 0, on_host = 0;
            const Status done = scene.round(on_device, on_host);
            ASSERT_TRUE(done) << done.message();
            device_ms.push_back(1e3 * on_device), host_ms.push_back(1e3 * on_host);
        }
        scene.expect_known();
        // Each round tells of most of those that are active, and of hardly any others.
        EXPECT_GT(scene.told(), uint64_t{rounds} * active / 3);
        EXPECT_LE(scene.told(), uint64_t{rounds} * (active + 20));
        EXPECT_GT(scene.evictions(), 0u);
        const auto median = [](std::vector<double>& values) {
            std::nth_element(values.begin(), values.begin() + rounds / 2, values.end());
            return values[rounds / 2];
        };
        std::printf("%7u blocks, %4u active, %6u resident: report %.3f ms, host %.3f ms a round\n", blocks, active, resident, median(device_ms),
                    median(host_ms));
    }

    std::unique_ptr<Device> device_;
};

TEST_F(ManyBlocksOnDevice, cost_by_those_that_are_active) {
    for (const uint32_t active : {200u, 1000u, 4000u})
        for (const uint32_t blocks : {10'000u, 100'000u, 1'000'000u}) measure(blocks, active, active / 2);
}

TEST_F(ManyBlocksOnDevice, cost_no_more_where_many_others_are_resident) {
    for (const uint32_t resident : {3000u, 30'000u, 300'000u}) measure(1'000'000, 1000, resident);
}

}  // namespace
}  // namespace raypager
