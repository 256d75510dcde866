// More instances than the memory is enough for: they go over the disk, and what comes out is the same.
#include <gtest/gtest.h>

#include <atomic>
#include <cerrno>
#include <cstring>
#include <map>

#include "support/failing_file_system.hpp"
#include "support/temporary_folder.hpp"
#include "unit/bake_instanced_scene.hpp"

namespace raypager {
namespace {

using namespace blocks_test;

// Half as many again as the smallest limit is enough for.
constexpr uint32_t many = 200'000;

// A source that says it has few.
class Understated final : public InstanceSource {
public:
    explicit Understated(std::vector<Placement> placements) : all_("understated", std::move(placements)) {}
    Status stream(const std::function<Status(std::span<const Placement>)>& take) const override { return all_.stream(take); }
    uint64_t count() const override { return 1000; }
    std::string name() const override { return all_.name(); }
    uint64_t fingerprint() const override { return 0; }

private:
    InstancesInMemory all_;
};

class BakeInstancesOverDisk : public testing::Test {
protected:
    BakeInstancesOverDisk() {
        scene_.objects[1].shapes = {mesh_shape(icosphere(1))};  // small: these tests are about instances
        placements_ = random_placements(many, 2, 77);
        // Some of them are dropped, so that numbers are not those of the placements.
        for (size_t i = 0; i < placements_.size(); i += 1000) placements_[i].to_world[1] = {};
        scene_.instances = {std::make_shared<InstancesInMemory>("here", placements_)};
    }

    static BakeOptions within(uint64_t host_limit) {
        BakeOptions options;
        options.block_bytes = 64 << 10;
        options.host_limit = host_limit;
        return options;
    }

    // Of all instances: by number, their records without the paths, which differ.
    static std::map<uint32_t, rp_instance> records_of(const BlockFile& file) {
        std::map<uint32_t, rp_instance> records;
        for (uint32_t block = 0; block < file.scene().blocks.size(); block++) {
            if (file.scene().blocks[block].instances == 0) continue;
            AlignedBytes bytes = read_block(file, block);
            const Status sound = file.check_block(block, bytes.span());
            EXPECT_TRUE(sound.ok()) << sound.message();
            const InstanceBlock view(bytes.span());
            for (size_t i = 0; i < view.records.size(); i++) {
                rp_instance record = view.records[i];
                record.path_low = record.path_high = 0;
                EXPECT_TRUE(records.emplace(view.numbers[i], record).second) << view.numbers[i];
            }
        }
        return records;
    }

    void expect_the_same_over_the_disk(const Scene& other) {
        const auto in_memory = bake(scene_, within(uint64_t{1} << 30), folder_ / "a.rpb");
        ASSERT_TRUE(in_memory.ok()) << in_memory.status().message();
        EXPECT_EQ(in_memory->buckets, 0u);
        const auto over_disk = bake(other, within(smallest_bake_limit()), folder_ / "b.rpb");
        ASSERT_TRUE(over_disk.ok()) << over_disk.status().message();
        EXPECT_GT(over_disk->buckets, 2u);
        EXPECT_EQ(over_disk->instances, many - many / 1000);
        ASSERT_EQ(over_disk->issues.warnings.size(), 1u);
        EXPECT_NE(over_disk->issues.warnings[0].text.find(": 200 instances flattened or out of range: dropped"), std::string::npos);
        const auto a = *BlockFile::open(folder_ / "a.rpb"), b = *BlockFile::open(folder_ / "b.rpb");
        EXPECT_EQ(std::memcmp(a->scene().lower, b->scene().lower, sizeof a->scene().lower), 0);
        EXPECT_EQ(std::memcmp(a->scene().upper, b->scene().upper, sizeof a->scene().upper), 0);
        const auto expected = records_of(*a), found = records_of(*b);
        ASSERT_EQ(expected.size(), many - many / 1000);
        ASSERT_EQ(found.size(), expected.size());
        for (auto x = expected.begin(), y = found.begin(); x != expected.end(); ++x, ++y) {
            ASSERT_EQ(x->first, y->first);
            ASSERT_EQ(std::memcmp(&x->second, &y->second, sizeof x->second), 0) << x->first;
        }
    }

    TemporaryFolder folder_;
    Scene scene_ = instanced_scene(0);
    std::vector<Placement> placements_;
};

TEST_F(BakeInstancesOverDisk, TheSameInstancesUnderTheSameNumbers) { expect_the_same_over_the_disk(scene_); }

// Then the first of them are in memory already.
TEST_F(BakeInstancesOverDisk, ThoseOfASourceThatUnderstatesThem) {
    Scene other = scene_;
    other.instances = {std::make_shared<Understated>(placements_)};
    expect_the_same_over_the_disk(other);
}

TEST_F(BakeInstancesOverDisk, TwiceIsTheSame) {
    for (const char* name : {"a.rpb", "b.rpb"}) ASSERT_TRUE(bake(scene_, within(smallest_bake_limit()), folder_ / name).ok());
    EXPECT_EQ(support::read_file(folder_ / "a.rpb"), support::read_file(folder_ / "b.rpb"));
}

TEST_F(BakeInstancesOverDisk, StopsAtAnyMomentWithoutATrace) {
    for (const double moment : {0.2, 0.45, 0.55, 0.9}) {
        SCOPED_TRACE(moment);
        std::atomic<bool> stop = false;
        BakeOptions options = within(smallest_bake_limit());
        options.stop = &stop;
        options.progress = [&](const char* stage, double fraction) {
            if (stage == std::string_view("instances") && fraction >= moment) stop = true;
        };
        const auto baked = bake(scene_, options, folder_ / "a.rpb");
        ASSERT_TRUE(stop);
        ASSERT_FALSE(baked.ok());
        EXPECT_NE(baked.status().message().find("stopped"), std::string::npos) << baked.status().message();
        EXPECT_TRUE(folder_.files().empty());
    }
}

// The disk fills up, or fails to be read, at any write or read.
TEST_F(BakeInstancesOverDisk, AFailingDiskIsOneClearError) {
    support::FailingFileSystem disk;
    int met = 0;
    for (const bool write : {true, false}) {
        auto& countdown = write ? disk.fail_write_in : disk.fail_read_in;
        for (const int after : {1, 12, 40, 100}) {
            SCOPED_TRACE(testing::Message() << (write ? "write " : "read ") << after);
            disk.error_number = write ? ENOSPC : EIO;
            countdown = after;
            const auto baked = bake(scene_, within(smallest_bake_limit()), folder_ / "a.rpb");
            const bool failed = countdown <= 0;
            disk.clear();
            EXPECT_EQ(baked.ok(), !failed);
            met += failed;
            if (!failed) {
                std::filesystem::remove(folder_ / "a.rpb");
                continue;
            }
            EXPECT_EQ(baked.status().message().find('\n'), std::string::npos);
            EXPECT_NE(baked.status().message().find(folder_.path().string()), std::string::npos) << baked.status().message();
            EXPECT_NE(baked.status().message().find(write ? "No space left" : "Input/output error"), std::string::npos) << baked.status().message();
            EXPECT_TRUE(folder_.files().empty());
        }
    }
    EXPECT_GT(met, 5) << "the faults did not happen";
}

}  // namespace
}  // namespace raypager
