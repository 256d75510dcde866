// Thousands of tiny blocks through a pool for two of them, while reads come up short and everything that touches a file or the device
// waits for random times: whatever order loads arrive in, the film is the same.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <random>
#include <set>
#include <thread>

#include "fault/tiny_blocks.hpp"
#include "raypager/abi/path.h"
#include "raypager/abi/wide.h"
#include "residency/read_ahead.hpp"
#include "support/failing_device.hpp"
#include "support/failing_file_system.hpp"
#include "support/thorough.hpp"

namespace raypager {
namespace {

using PagingStressOnDevice = TinyBlocks;

TEST_F(PagingStressOnDevice, TheFilmIsTheSameForEverySchedule) {
    const char* wanted = std::getenv("RAYPAGER_SCHEDULES");
    const int schedules = wanted ? std::atoi(wanted) : support::thorough() ? 50 : 3;
    const uint32_t first_seed = std::random_device{}();
    for (int i = 0; i < schedules; i++) {
        const uint32_t seed = first_seed + static_cast<uint32_t>(i);
        std::mt19937 random(seed);
        support::TestOptions options = options_;
        options.geometry_limit = 2 * uint64_t{file_->scene().largest_block(support::default_form())};
        options.tuning.policy = policy_names[random() % std::size(policy_names)].kind;
        options.tuning.loads_in_flight = 1 + random() % 3;
        options.instruments.loader_threads = 1 + random() % 4;
        options.instruments.read_ahead_threads = random() % 4;
        options.host_limit = random() % 2 ? 1 : uint64_t{1} << 30;  // no cache at all, or one for everything
        disk_.seed = seed;
        disk_.longest_delay_us = 1 + random() % 300;
        disk_.one_short_in = 3;
        const std::string what = fmt::format("seed {}, {}, {} loads in flight by {} threads, {} that read ahead, host limit {}", seed,
                                             policy_name(options.tuning.policy), options.tuning.loads_in_flight, options.instruments.loader_threads,
                                             *options.instruments.read_ahead_threads, options.host_limit);
        SCOPED_TRACE(what);
        const auto result = render(*file_, options, {});
        disk_.clear();
        ASSERT_TRUE(result.ok()) << result.status().message();
        EXPECT_EQ(result->report.film_hash, hash_);
        EXPECT_LE(result->report.peak.geometry_bytes, options.geometry_limit);
        EXPECT_GT(result->report.paging.evictions, 0u);
        fmt::print("{}: {} loads of {} blocks\n", what, result->report.paging.loads, file_->scene().blocks.size());
    }
}

// Whether these bytes are a block in that form.
bool is_block(std::span<const std::byte> bytes, BlockForm form, uint32_t block) {
    if (form == BlockForm::wide) {
        rp_wide_header header;
        std::memcpy(&header, bytes.data(), sizeof header);
        return header.magic == RP_WIDE_MAGIC && header.block == block && header.bytes == bytes.size();
    }
    rp_block_header header;
    std::memcpy(&header, bytes.data(), sizeof header);
    return header.magic == RP_BLOCK_MAGIC && header.block_index == block && header.bytes == bytes.size();
}

// The cache in front of the file, used by several threads at once with room for a few blocks: everybody gets the right bytes, and whoever
// waits is woken.
void use_from_many_threads(const BlockFile& file, BlockForm form, support::FailingFileSystem& disk) {
    auto device = Device::open("", 0);
    ASSERT_TRUE(device.ok()) << device.status().message();
    const BakedScene& scene = file.scene();
    HostCache cache(**device, file, form, 9 * uint64_t{scene.largest_block(form)});
    const uint32_t seed = std::random_device{}();
    SCOPED_TRACE(seed);
    disk.seed = seed;
    disk.longest_delay_us = 100;
    std::atomic<int> wrong{0}, failed{0};
    const auto use_blocks = [&](uint32_t thread_seed) {
        std::mt19937 random(thread_seed);
        for (int i = 0; i < 300; i++) {
            const auto block = static_cast<uint32_t>(random() % 24);  // few, so that threads meet at the same ones
            const auto bytes = cache.acquire(block);
            if (!bytes) {
                failed++;
                continue;
            }
            disk.delay();
            wrong += !is_block(*bytes, form, block) || bytes->size() != scene.blocks[block].bytes(form);
            cache.release(block);
        }
    };
    std::vector<std::thread> threads;
    for (uint32_t t = 0; t < 6; t++) threads.emplace_back(use_blocks, seed + t);
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(wrong, 0);
    EXPECT_EQ(failed, 0);
}

TEST_F(PagingStressOnDevice, TheHostCacheServesManyThreads) {
    for (const BlockForm form : {BlockForm::stored, BlockForm::wide}) use_from_many_threads(*file_, form, disk_);
}

// Without any pinned memory there is no cache; without a later piece it makes do with what it has.
TEST_F(PagingStressOnDevice, TheHostCacheMakesDoWithThePinnedMemoryItGets) {
    const BlockForm form = support::default_form();
    const auto failing_device = std::make_shared<support::FailingDevice>();
    auto device = Device::open("", 0, {}, failing_device);
    ASSERT_TRUE(device.ok()) << device.status().message();
    const struct {
        int64_t failing;
        uint32_t threads;
        int least_refused, most_refused;  // who asked for the first piece alone; later callers try again
    } cases[] = {{1, 1, 1, 1}, {1, 4, 0, 1}, {3, 4, 0, 0}};
    for (const auto& c : cases) {
        SCOPED_TRACE(testing::Message() << "piece " << c.failing << ", " << c.threads << " threads");
        HostCache cache(**device, *file_, form, 9 * uint64_t{file_->scene().largest_block(form)});
        failing_device->fail_pinned_in = c.failing;
        std::atomic<int> failed{0};
        std::vector<std::thread> threads;
        for (uint32_t t = 0; t < c.threads; t++)
            threads.emplace_back([&, t] {
                for (uint32_t block = t; block < 200; block++) {
                    const auto bytes = cache.acquire(block);
                    failed += !bytes.ok();
                    if (!bytes.ok()) continue;
                    EXPECT_TRUE(is_block(*bytes, form, block));
                    cache.release(block);
                }
            });
        for (std::thread& thread : threads) thread.join();
        EXPECT_LE(failing_device->fail_pinned_in, 0);
        EXPECT_GE(failed, c.least_refused);
        EXPECT_LE(failed, c.most_refused);
        EXPECT_GT(cache.peak_bytes(), 0u);
        EXPECT_LE(cache.peak_bytes(), 9 * uint64_t{file_->scene().largest_block(form)});
    }
}

// Two pieces of pinned memory come at a time, to two threads that need some. Where one fails, its thread gets room in the other; where both do, both
// are refused, and the cache is none the smaller for it afterwards.
TEST_F(PagingStressOnDevice, TheHostCacheGetsPinnedMemoryTwoPiecesAtATime) {
    const BlockForm form = support::default_form();
    const auto failing_device = std::make_shared<support::FailingDevice>();
    auto device = Device::open("", 0, {}, failing_device);
    ASSERT_TRUE(device.ok()) << device.status().message();
    if (!(*device)->thread_safe()) GTEST_SKIP() << "no threads on this device";
    const uint64_t limit = 9 * uint64_t{file_->scene().largest_block(form)};
    for (const int failures : {0, 1, 2}) {
        SCOPED_TRACE(failures);
        HostCache cache(**device, *file_, form, limit);
        failing_device->hold_pinned = true;
        failing_device->fail_pinned_in = failures == 1;
        failing_device->fail_pinned = failures == 2;
        std::atomic<int> refused{0};
        std::vector<std::thread> threads;
        for (uint32_t block : {0, 1})
            threads.emplace_back([&, block] {
                const auto bytes = cache.acquire(block);
                refused += !bytes.ok();
                if (!bytes.ok()) return;
                EXPECT_TRUE(is_block(*bytes, form, block));
                cache.release(block);
            });
        for (int i = 0; failing_device->held_pinned < 2 && i < 60000; i++) std::this_thread::sleep_for(std::chrono::milliseconds(1));
        EXPECT_EQ(failing_device->held_pinned, 2);
        EXPECT_EQ(cache.peak_bytes(), 0u);
        failing_device->hold_pinned = false;
        for (std::thread& thread : threads) thread.join();
        EXPECT_EQ(refused, failures == 2 ? 2 : 0);
        failing_device->fail_pinned = false;
        if (failures == 1) continue;
        while (cache.prepare(limit)) {}
        EXPECT_GT(cache.peak_bytes(), limit / 2);
        EXPECT_LE(cache.peak_bytes(), limit);
    }
}

// What is read ahead is there for who comes for it, and takes no room from others.
TEST_F(PagingStressOnDevice, TheHostCacheReadsAheadWhereThereIsRoom) {
    const BlockForm form = support::default_form();
    auto device = Device::open("", 0);
    ASSERT_TRUE(device.ok()) << device.status().message();
    const BakedScene& scene = file_->scene();
    HostCache cache(**device, *file_, form, 9 * uint64_t{scene.largest_block(form)});
    EXPECT_FALSE(cache.knows(7));
    EXPECT_FALSE(cache.acquire_if_there(7));
    EXPECT_TRUE(cache.read_ahead(7));
    EXPECT_TRUE(cache.knows(7));
    const auto bytes = cache.acquire_if_there(7);
    ASSERT_TRUE(bytes);
    EXPECT_TRUE(is_block(*bytes, form, 7));
    cache.release(7);
    EXPECT_TRUE(cache.knows(7));
    uint32_t block = 8;
    while (block < scene.blocks.size() && cache.read_ahead(block)) block++;
    EXPECT_GT(block, 12u);
    EXPECT_LT(block, scene.blocks.size());
    for (uint32_t known = 7; known < block; known++) EXPECT_TRUE(cache.knows(known)) << known;
    EXPECT_FALSE(cache.knows(block));
    EXPECT_LE(cache.peak_bytes(), 9 * uint64_t{scene.largest_block(form)});
    // Whoever needs it takes the room.
    ASSERT_TRUE(cache.acquire(block).ok());
    cache.release(block);
    cache.close();
    EXPECT_FALSE(cache.read_ahead(0));
}

// Where each block is acquired once, released blocks make room for those that are read ahead.
TEST_F(PagingStressOnDevice, TheHostCacheForgetsWhatIsNeededOnce) {
    const BlockForm form = support::default_form();
    auto device = Device::open("", 0);
    ASSERT_TRUE(device.ok()) << device.status().message();
    const BakedScene& scene = file_->scene();
    const uint64_t limit = 9 * uint64_t{scene.largest_block(form)};
    HostCache cache(**device, *file_, form, limit, true);
    while (cache.prepare(limit)) {}
    const uint64_t prepared = cache.peak_bytes();
    EXPECT_GT(prepared, 0u);
    EXPECT_LE(prepared, limit);
    for (uint32_t block = 0; block < 200; block++) {
        ASSERT_TRUE(cache.read_ahead(block)) << block;
        const auto bytes = cache.acquire(block);
        ASSERT_TRUE(bytes.ok());
        EXPECT_TRUE(is_block(*bytes, form, block));
        cache.release(block);
        EXPECT_FALSE(cache.knows(block));
    }
    EXPECT_EQ(cache.peak_bytes(), prepared);
}

// Threads read ahead what a changing list says while others come for blocks, in a cache with room for a few: everybody gets the right bytes.
TEST_F(PagingStressOnDevice, BlocksAreReadAheadBesideLoads) {
    const BlockForm form = support::default_form();
    auto device = Device::open("", 0);
    ASSERT_TRUE(device.ok()) << device.status().message();
    if (!(*device)->thread_safe()) GTEST_SKIP() << "no threads on this device";
    const uint32_t seed = std::random_device{}();
    SCOPED_TRACE(seed);
    disk_.seed = seed;
    disk_.longest_delay_us = 100;
    for (const bool once : {false, true}) {
        HostCache cache(**device, *file_, form, 9 * uint64_t{file_->scene().largest_block(form)}, once);
        ReadAhead ahead(cache, 3, 1 << 20);
        std::atomic<int> wrong{0};
        std::vector<std::thread> threads;
        for (uint32_t t = 0; t < 3; t++)
            threads.emplace_back([&, t] {
                std::mt19937 random(seed + t);
                for (int i = 0; i < 200; i++) {
                    const auto block = static_cast<uint32_t>(random() % 40);
                    ahead.request({block, (block + 1) % 40, (block + 2) % 40, (block + 3) % 40});
                    const auto bytes = cache.acquire(block);
                    wrong += !bytes.ok() || !is_block(*bytes, form, block);
                    if (bytes.ok()) cache.release(block);
                }
            });
        for (std::thread& thread : threads) thread.join();
        EXPECT_EQ(wrong, 0);
    }
}

// What is wanted is read without anybody coming for it; what cannot be read is left to its load.
TEST_F(PagingStressOnDevice, WhatRaysWaitForIsReadAhead) {
    const BlockForm form = support::default_form();
    auto device = Device::open("", 0);
    ASSERT_TRUE(device.ok()) << device.status().message();
    if (!(*device)->thread_safe()) GTEST_SKIP() << "no threads on this device";
    HostCache cache(**device, *file_, form, uint64_t{1} << 30);
    ReadAhead ahead(cache, 2, 0);
    const auto is_there = [&](uint32_t block) {
        const bool there = cache.acquire_if_there(block).has_value();
        if (there) cache.release(block);
        return there;
    };
    const auto within_seconds = [](const auto& condition) {
        for (int i = 0; i < 5000 && !condition(); i++) std::this_thread::sleep_for(std::chrono::milliseconds(1));
        return condition();
    };
    const std::vector<uint32_t> blocks = {3, 1, 4, 15, 9, 2, 6, 5};
    ahead.request(blocks);
    EXPECT_TRUE(within_seconds([&] { return std::all_of(blocks.begin(), blocks.end(), is_there); }));
    ahead.request({});
    disk_.error_number = EIO;
    disk_.fail_read_in = 1;
    ahead.request({50});
    EXPECT_TRUE(within_seconds([&] { return disk_.fail_read_in <= 0; }));
    EXPECT_TRUE(within_seconds([&] { return !cache.knows(50); }));
    const auto bytes = cache.acquire(50);
    ASSERT_TRUE(bytes.ok());
    EXPECT_TRUE(is_block(*bytes, form, 50));
    cache.release(50);
}

// What comes between two publications of the page table, and is still there, is named with the second, once. Entries that change are all there are.
TEST_F(PagingStressOnDevice, ResidencyNamesTheBlocksThatItPublishes) {
    const BlockForm form = support::default_form();
    auto device = Device::open("", 0);
    ASSERT_TRUE(device.ok()) << device.status().message();
    const auto count = static_cast<uint32_t>(file_->scene().blocks.size());
    ResidencySettings settings;
    settings.form = form;
    settings.pool_bytes = 4 * uint64_t{file_->scene().largest_block(form)};
    settings.policy = default_settings(PolicyKind::lru);
    auto residency = Residency::create(**device, *file_, settings);
    ASSERT_TRUE(residency.ok()) << residency.status().message();
    std::set<uint32_t> seen;
    std::vector<bool> there(count);
    for (uint32_t round = 1; round <= 60; round++) {
        const rp_block_demand demand[] = {{(round - 1) * 7 % count, 0, 0, 0}, {round * 7 % count, 5, 0, 0}};
        (*residency)->take_demand(round, demand);
        ASSERT_TRUE((*residency)->after_round(round, round, Event(), 0, 1).ok());
        if (round % 3 == 0) {
            ASSERT_TRUE((*residency)->wait_for_block(round).ok());
        }
        if (round % 2 == 0) continue;  // two rounds of arrivals in one publication
        ASSERT_TRUE((*residency)->publish((*device)->kernels()).ok());
        const auto names = (*residency)->newly_published();
        const auto changes = (*residency)->page_changes();
        for (uint32_t block = 0; block < count; block++) {
            const bool resident = (*residency)->blocks()[block].state == PageState::resident;
            const bool named = std::find(names.begin(), names.end(), block) != names.end();
            EXPECT_TRUE(resident || !named) << "block " << block << ", round " << round;
            EXPECT_TRUE(named || there[block] || !resident) << "block " << block << ", round " << round;
            EXPECT_LE(std::count(names.begin(), names.end(), block), 1) << "block " << block << ", round " << round;
            const auto change = std::find_if(changes.begin(), changes.end(), [&](const rp_page& page) { return page.block == block; });
            // The first publication writes the whole table.
            if (change != changes.end())
                EXPECT_EQ(change->address != RP_NONE, resident);
            else
                EXPECT_TRUE(round == 1 || resident == there[block]);
            there[block] = resident;
        }
        seen.insert(names.begin(), names.end());
        ASSERT_TRUE((*residency)->publish((*device)->kernels()).ok());
        EXPECT_TRUE((*residency)->newly_published().empty());
        EXPECT_TRUE((*residency)->page_changes().empty());
    }
    EXPECT_GT(seen.size(), 10u);
    EXPECT_GT((*residency)->statistics().evictions, 0u);
    ASSERT_TRUE((*device)->kernels().finish().ok());
}

// Nothing is read more often than it has to be: what is read ahead is what comes next, and stays until it has come.
TEST_F(PagingStressOnDevice, WhatIsReadAheadIsNotReadAgain) {
    const BlockForm form = support::default_form();
    auto device = Device::open("", 0, {}, std::make_shared<SlowUploads>(disk_));
    ASSERT_TRUE(device.ok()) << device.status().message();
    const BakedScene& scene = file_->scene();
    const uint64_t largest = scene.largest_block(form), average = scene.geometry_bytes(form) / scene.blocks.size();
    for (const uint32_t readers : {0u, 1u, 4u}) {
        SCOPED_TRACE(readers);
        ResidencySettings settings;
        settings.form = form;
        settings.pool_bytes = pool_for_all(scene.geometry_bytes(form), (*device)->info().max_allocation_bytes, largest);
        settings.host_limit = 128 * largest;  // fewer than may be on their way
        settings.policy = default_settings(PolicyKind::aged_wants, settings.pool_bytes, average, profile_of_cores(0));
        settings.read_ahead_threads = readers;
        auto residency = Residency::create(**device, *file_, settings);
        ASSERT_TRUE(residency.ok()) << residency.status().message();
        constexpr int64_t many = int64_t{1} << 40;
        disk_.seed = 1;
        disk_.longest_delay_us = 200;
        disk_.only_file = "tiny.rpb";
        disk_.fail_read_in = many;
        ASSERT_TRUE((*residency)->load_all((*device)->kernels()).ok());
        const int64_t reads = many - disk_.fail_read_in;
        disk_.clear();
        EXPECT_GE(reads, static_cast<int64_t>(scene.blocks.size()));
        EXPECT_LE(reads, static_cast<int64_t>(scene.blocks.size() * 21 / 20));
        fmt::print("{} readers: {} reads of {} blocks\n", readers, reads, scene.blocks.size());
        ASSERT_TRUE((*device)->kernels().finish().ok());
    }
}

// A block that could not be read ahead is as absent as before.
TEST_F(PagingStressOnDevice, WhoComesForABlockThatCouldNotBeReadAheadReadsIt) {
    const BlockForm form = support::default_form();
    auto device = Device::open("", 0);
    ASSERT_TRUE(device.ok()) << device.status().message();
    HostCache cache(**device, *file_, form, uint64_t{1} << 30);
    for (const int error : {ENOMEM, EIO}) {
        disk_.error_number = error;
        disk_.fail_read_in = 1;
        EXPECT_TRUE(cache.read_ahead(50));
        disk_.clear();
        EXPECT_FALSE(cache.knows(50));
    }
    const auto bytes = cache.acquire(50);
    ASSERT_TRUE(bytes.ok());
    cache.release(50);
}

// A read of a block that fails, at the start, in the middle or at the end of a render, ends it with the file's name and the block's, soon
// and without a picture. (One that fails ahead of a load does no harm: the load reads again.)
TEST_F(PagingStressOnDevice, AFailingReadEndsTheRender) {
    support::TestOptions options = options_;
    options.instruments.read_ahead_threads = 0;
    options.geometry_limit = 2 * uint64_t{file_->scene().largest_block(support::default_form())};
    options.host_limit = 1;
    const auto whole = render(*file_, options, {});
    ASSERT_TRUE(whole.ok()) << whole.status().message();
    // Loads are issued in an order that the device's timing may change a little, hence not the very last one.
    const auto loads = static_cast<int64_t>(whole->report.paging.loads);
    ASSERT_GT(loads, 10);
    for (const int64_t n : {int64_t{1}, loads / 2, loads * 4 / 5}) {
        disk_.error_number = EIO;
        disk_.only_file = "tiny.rpb";
        disk_.fail_read_in = n;
        const auto result = render(*file_, options, {});
        EXPECT_LE(disk_.fail_read_in, 0) << n << " of " << loads;
        disk_.clear();
        ASSERT_FALSE(result.ok()) << n << " of " << loads;
        EXPECT_NE(result.status().message().find("tiny.rpb"), std::string::npos) << result.status().message();
        EXPECT_NE(result.status().message().find("block "), std::string::npos) << result.status().message();
    }
}

}  // namespace
}  // namespace raypager
