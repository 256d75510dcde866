// Blocks that several processes keep for each other: who keeps which, and what happens when one is slow, damages bytes, or has no file.
#include <gtest/gtest.h>

#include <algorithm>
#include <barrier>
#include <chrono>
#include <filesystem>
#include <functional>
#include <future>
#include <map>
#include <mutex>
#include <numeric>
#include <optional>
#include <random>
#include <thread>

#include "raypager/bake.hpp"
#include "store/block_file.hpp"
#include "store/scene_sections.hpp"
#include "store/sharded_blocks.hpp"
#include "store/shards.hpp"
#include "support/memory_source.hpp"
#include "support/small_scene.hpp"
#include "support/temporary_folder.hpp"
#include "support/thread_peers.hpp"

namespace raypager {
namespace {

TEST(Owners, have_shares_like_their_room) {
    const std::vector<uint32_t> blocks(1000, 100);
    const std::vector<uint64_t> room = {100000, 50000, 0, 50000};
    std::vector<uint64_t> used(room.size());
    const auto owners = choose_owners(blocks, room);
    for (const uint32_t owner : owners) {
        ASSERT_LT(owner, room.size());
        used[owner] += 100;
    }
    EXPECT_NEAR(static_cast<double>(used[0]), 50000, 200);
    EXPECT_NEAR(static_cast<double>(used[1]), 25000, 200);
    EXPECT_EQ(used[2], 0u);
    EXPECT_NE(owners[10], owners[12]);  // neighbours are not all with one
}

TEST(Owners, have_no_more_than_there_is_room_for) {
    const auto seed = std::random_device()();
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    std::mt19937 random(seed);
    for (int i = 0; i < 50; i++) {
        std::vector<uint32_t> blocks(random() % 300);
        for (uint32_t& bytes : blocks) bytes = 1 + random() % 1000;
        std::vector<uint64_t> room(1 + random() % 9);
        for (uint64_t& bytes : room) bytes = random() % 3 ? random() % 30000 : 0;
        const auto owners = choose_owners(blocks, room);
        ASSERT_EQ(owners.size(), blocks.size());
        std::vector<uint64_t> used(room.size());
        uint64_t kept = 0;
        for (size_t block = 0; block < blocks.size(); block++) {
            if (owners[block] == no_owner) continue;
            used[owners[block]] += blocks[block];
            kept += blocks[block];
        }
        for (size_t rank = 0; rank < room.size(); rank++) EXPECT_LE(used[rank], room[rank]);
        // At most one block's room is left over at each.
        const auto all = std::accumulate(blocks.begin(), blocks.end(), uint64_t{0}), most = std::accumulate(room.begin(), room.end(), uint64_t{0});
        EXPECT_GE(kept + 1000 * (room.size() + 1), std::min(all, most));
    }
}

TEST(Owners, leave_out_blocks_evenly) {
    const auto owners = choose_owners(std::vector<uint32_t>(1000, 100), std::vector<uint64_t>{20000, 5000});
    for (size_t part = 0; part < 4; part++) {
        const auto begin = owners.begin() + static_cast<ptrdiff_t>(part * 250);
        EXPECT_NEAR(static_cast<double>(std::count(begin, begin + 250, no_owner)), 187, 3);
    }
}

class Shards : public testing::Test {
protected:
    static constexpr uint32_t ranks = 3;

    void SetUp() override {
        BakeOptions options;
        options.block_bytes = 16 << 10;
        const auto baked = bake(support::small_scene(90), options);
        ASSERT_TRUE(baked.ok()) << baked.status().message();
        auto memory = support::MemorySource::copy_of(baked->blocks.source());
        ASSERT_TRUE(memory.ok());
        file_.emplace(std::move(*memory));
        without_file_.emplace(file_->scene());
        ASSERT_GT(count(), 20u);
    }

    uint32_t count() const { return file_->scene().pageable_count(); }

    // A source that has the scene alone, as who does not reach the file.
    class Unreachable final : public BlockSource {
    public:
        explicit Unreachable(BakedScene scene) : scene_(std::move(scene)) {}
        const BakedScene& scene() const override { return scene_; }
        bool has_bytes() const override { return false; }
        Origin origin() const override { return {"far.rpb", 0}; }

    private:
        Status fetch(uint32_t, std::span<std::byte>) const override { return Status::failed("far.rpb is not there"); }
        Status damaged(uint32_t, const std::string& what) const override { return Status::failed(what); }
        BakedScene scene_;
    };

    struct Seen {
        Status created;
        std::map<uint32_t, std::string> errors;  // of blocks
        ShardedBlocks::Figures figures;
        std::vector<std::string> warnings;
    };

    // Each rank reads all blocks; then all end.
    std::vector<Seen> read_all(const std::vector<bool>& reaches, uint64_t room, const std::function<void()>& once_made = {}) {
        std::vector<std::future<Seen>> futures;
        std::barrier<> barrier(ranks);
        for (uint32_t rank = 0; rank < ranks; rank++)
            futures.push_back(std::async(std::launch::async, [&, rank] {
                Seen seen;
                std::mutex mutex;
                const BlockSource& own = reaches[rank] ? static_cast<const BlockSource&>(*file_) : *without_file_;
                auto blocks = ShardedBlocks::create(own, group_.peer(rank), room, [&](const std::string& text) {
                    const std::lock_guard lock(mutex);
                    seen.warnings.push_back(text);
                });
                seen.created = blocks.status();
                if (!blocks) return seen;
                while (!(*blocks)->is_full()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
                barrier.arrive_and_wait();
                if (rank == 0 && once_made) once_made();
                barrier.arrive_and_wait();
                for (uint32_t i = 0; i < count(); i++) {
                    std::vector<std::byte> bytes((*blocks)->scene().pageable_bytes(i, BlockForm::stored));
                    const Status status = (*blocks)->read(i, bytes);
                    if (!status)
                        seen.errors[i] = status.message();
                    else
                        EXPECT_EQ(bytes, file_->block(i));
                }
                seen.figures = (*blocks)->figures();
                barrier.arrive_and_wait();
                return seen;
            }));
        std::vector<Seen> all;
        for (auto& future : futures) all.push_back(future.get());
        return all;
    }

    support::PeerThreads group_{ranks};
    std::optional<support::MemorySource> file_;
    std::optional<Unreachable> without_file_;
    static constexpr uint64_t enough = uint64_t{1} << 30;
};

TEST_F(Shards, hold_every_block_once) {
    uint64_t kept = 0;
    for (const Seen& seen : read_all({true, true, true}, enough)) {
        ASSERT_TRUE(seen.created.ok()) << seen.created.message();
        EXPECT_TRUE(seen.errors.empty());
        EXPECT_EQ(seen.figures.from_memory + seen.figures.from_peers + seen.figures.from_file, file_->scene().memory_bytes(BlockForm::stored));
        kept += seen.figures.kept_bytes;
    }
    EXPECT_EQ(kept, file_->scene().memory_bytes(BlockForm::stored));
}

TEST_F(Shards, need_the_file_in_one_place) {
    for (const std::vector<bool>& reaches : {std::vector{true, false, false}, std::vector{false, true, false}, std::vector{false, true, true}}) {
        const auto all = read_all(reaches, enough);
        for (uint32_t rank = 0; rank < ranks; rank++) {
            ASSERT_TRUE(all[rank].created.ok()) << all[rank].created.message();
            EXPECT_TRUE(all[rank].errors.empty()) << all[rank].errors.begin()->second;
            if (!reaches[rank]) {
                EXPECT_GT(all[rank].figures.from_peers, 0u);
                EXPECT_EQ(all[rank].figures.from_file, 0u);
            }
        }
    }
}

TEST_F(Shards, read_from_the_file_what_there_is_no_room_for) {
    const uint64_t third = file_->scene().memory_bytes(BlockForm::stored) / 9;
    for (const Seen& seen : read_all({true, true, true}, third)) {
        ASSERT_TRUE(seen.created.ok()) << seen.created.message();
        EXPECT_TRUE(seen.errors.empty());
        EXPECT_LE(seen.figures.kept_bytes, third);
        EXPECT_GT(seen.figures.from_file, 0u);
    }
    for (const Seen& seen : read_all({true, false, true}, third)) {
        ASSERT_FALSE(seen.created.ok());
        EXPECT_NE(seen.created.message().find("rank 1 does not reach"), std::string::npos) << seen.created.message();
        EXPECT_NE(seen.created.message().find("--host-limit"), std::string::npos) << seen.created.message();
    }
    for (const Seen& seen : read_all({false, false, false}, enough)) EXPECT_FALSE(seen.created.ok());
}

TEST_F(Shards, do_not_believe_damaged_bytes) {
    const auto all = read_all({true, true, true}, enough, [this] { group_.damage(1); });
    for (const uint32_t rank : {0u, 2u}) {
        EXPECT_TRUE(all[rank].errors.empty());
        EXPECT_GT(all[rank].figures.damaged, 0u);
        ASSERT_EQ(all[rank].warnings.size(), 1u);
        EXPECT_NE(all[rank].warnings[0].find("damaged from rank 1"), std::string::npos) << all[rank].warnings[0];
    }
    EXPECT_EQ(all[1].figures.damaged, 0u);
}

// As by a cosmic ray: nobody uses the changed bytes, neither who keeps them nor who gets them.
TEST_F(Shards, notice_what_has_changed_in_memory) {
    uint32_t changed = 0;
    const auto all = read_all({true, true, true}, enough, [&] {
        for (uint32_t i = 0; i < count(); i++) changed += group_.change_kept(1, i);
    });
    ASSERT_GT(changed, 0u);
    for (const Seen& seen : all) {
        EXPECT_TRUE(seen.errors.empty()) << seen.errors.begin()->second;
        EXPECT_EQ(seen.figures.damaged, changed);
        ASSERT_EQ(seen.warnings.size(), 1u);
    }
    EXPECT_NE(all[1].warnings[0].find("has changed in memory"), std::string::npos) << all[1].warnings[0];
}

TEST_F(Shards, are_filled_again_with_what_came_damaged) {
    group_.spoil_once(1);
    for (const Seen& seen : read_all({true, false, false}, enough)) {
        ASSERT_TRUE(seen.created.ok()) << seen.created.message();
        EXPECT_TRUE(seen.errors.empty()) << seen.errors.begin()->second;
        EXPECT_EQ(seen.figures.damaged, 0u);
    }
}

TEST_F(Shards, say_what_is_damaged_where_no_file_is) {
    const auto all = read_all({true, true, false}, enough, [this] { group_.damage(1); });
    EXPECT_TRUE(all[0].errors.empty());
    ASSERT_FALSE(all[2].errors.empty());
    const std::string& message = all[2].errors.begin()->second;
    EXPECT_NE(message.find("rank 1"), std::string::npos) << message;
    EXPECT_NE(message.find("far.rpb"), std::string::npos) << message;
}

TEST_F(Shards, do_not_wait_for_a_slow_one) {
    const auto begin = std::chrono::steady_clock::now();
    const auto all = read_all({true, true, true}, enough, [this] { group_.make_slow(1, 60); });
    EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(30));
    for (const uint32_t rank : {0u, 2u}) {
        EXPECT_TRUE(all[rank].errors.empty());
        EXPECT_EQ(all[rank].figures.late, 1u);  // and is asked no more
        EXPECT_EQ(all[rank].warnings.size(), 1u);
        EXPECT_GT(all[rank].figures.from_file, 0u);
    }
}

TEST_F(Shards, say_which_block_of_the_file_is_damaged) {
    file_->lose(3);
    for (const std::vector<bool>& reaches : {std::vector{true, true, true}, std::vector{true, false, false}}) {
        const auto all = read_all(reaches, enough);
        for (uint32_t rank = 0; rank < ranks; rank++) {
            ASSERT_EQ(all[rank].errors.size(), 1u);
            EXPECT_EQ(all[rank].errors.begin()->first, 3u);
        }
    }
}

class HandedOut : public testing::Test {
protected:
    void SetUp() override {
        ASSERT_TRUE(bake(support::small_scene(12), {}, path_).ok());
        auto opened = Blocks::open(path_);
        ASSERT_TRUE(opened.ok()) << opened.status().message();
        own_ = *opened;
    }
    Result<Blocks> hand_out(const std::function<void()>& before = {}) {
        support::PeerThreads group(2);
        if (before) before();
        auto other = std::async(std::launch::async, [&] { return Blocks::hand_out(std::nullopt, group.peer(1)); });
        const auto own = Blocks::hand_out(own_, group.peer(0));
        EXPECT_TRUE(own.ok());
        return other.get();
    }
    support::TemporaryFolder folder_;
    const std::filesystem::path path_ = folder_ / "a.rpb";
    std::optional<Blocks> own_;
};

TEST_F(HandedOut, is_the_same_scene_and_file) {
    const auto other = hand_out();
    ASSERT_TRUE(other.ok()) << other.status().message();
    const BlockSource& source = other->source();
    EXPECT_EQ(source.scene().identity(), own_->source().scene().identity());
    EXPECT_EQ(source.scene().lights.size(), own_->source().scene().lights.size());
    EXPECT_EQ(source.scene().light_images.size(), own_->source().scene().light_images.size());
    ASSERT_TRUE(source.has_bytes());
    std::vector<std::byte> here(source.scene().blocks[0].stored_bytes), there(here.size());
    ASSERT_TRUE(source.read_block(0, here).ok());
    ASSERT_TRUE(own_->source().read_block(0, there).ok());
    EXPECT_EQ(here, there);
}

TEST_F(HandedOut, does_not_take_another_file_for_it) {
    auto other = hand_out([this] { std::filesystem::rename(path_, folder_ / "b.rpb"); });
    ASSERT_TRUE(other.ok()) << other.status().message();
    EXPECT_FALSE(other->source().has_bytes());
    ASSERT_TRUE(bake(support::small_scene(13), {}, path_).ok());
    other = hand_out();
    ASSERT_TRUE(other.ok()) << other.status().message();
    EXPECT_FALSE(other->source().has_bytes());
    std::vector<std::byte> bytes(other->source().scene().blocks[0].stored_bytes);
    EXPECT_NE(other->source().read_block(0, bytes).message().find(path_.string()), std::string::npos);
}

TEST_F(HandedOut, is_checked_as_a_file_is) {
    const auto whole = scene_bytes(own_->source().scene());
    ASSERT_TRUE(whole.ok());
    ASSERT_TRUE(scene_from_bytes(*whole).ok());
    const auto seed = std::random_device()();
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    std::mt19937 random(seed);
    const std::span<const std::byte> all(*whole);
    for (int i = 0; i < 100; i++) EXPECT_FALSE(scene_from_bytes(all.first(random() % all.size())).ok());
    EXPECT_FALSE(scene_from_bytes({}).ok());
}

}  // namespace
}  // namespace raypager
