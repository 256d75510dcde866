// Files: outputs appear whole or not at all, what killed processes left is told from what is being written, logs hold no half a row, scratch files
// take from many threads.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <span>
#include <utility>
#include <vector>

#include "base/files.hpp"
#include "base/parallel.hpp"
#include "support/failing_file_system.hpp"
#include "support/temporary_folder.hpp"

namespace raypager {
namespace {

using support::read_file;

class BaseFiles : public testing::Test {
protected:
    support::TemporaryFolder folder_;
    support::FailingFileSystem disk_;
};

TEST_F(BaseFiles, OnlyAbandonedTemporariesOfTheTargetAreRemoved) {
    auto being_written = OutputFile::create(folder_ / "a.rpb");
    ASSERT_TRUE(being_written.ok());
    for (const char* name : {".a.123.tmp.rpb", ".a.9.tmp.rpb", ".b.123.tmp.rpb", ".a.123.tmp.ply", ".a.12x.tmp.rpb", ".a..tmp.rpb", "a.123.tmp.rpb",
                             "a.rpb", ".a.b.5.tmp.rpb", ".tmp.rpb"})
        folder_.write(name, "x");
    EXPECT_EQ(remove_abandoned_temporaries(folder_ / "a.rpb"), 2u);
    EXPECT_FALSE(std::filesystem::exists(folder_ / ".a.123.tmp.rpb"));
    EXPECT_EQ(folder_.files().size(), 9u) << "others were removed, or the one that is being written";
    EXPECT_TRUE(being_written->write("new").ok());
    EXPECT_TRUE(being_written->commit().ok());
    EXPECT_EQ(read_file(folder_ / "a.rpb"), "new");
    EXPECT_EQ(remove_abandoned_temporaries(folder_ / "absent", ".rpb", [](std::string_view) { return true; }), 0u);
}

TEST_F(BaseFiles, WhatKilledWritersLeftGoesWithTheNextOne) {
    for (const char* name : {".a.123.tmp.ckpt", ".a.9.tmp.ckpt", ".b.9.tmp.ckpt"}) folder_.write(name, "x");
    ASSERT_TRUE(write_text(folder_ / "a.ckpt", "new").ok());
    EXPECT_EQ(folder_.files().size(), 2u);
    EXPECT_TRUE(std::filesystem::exists(folder_ / ".b.9.tmp.ckpt"));
}

TEST_F(BaseFiles, TwoWritersOfOneTargetDoNotMix) {
    auto first = OutputFile::create(folder_ / "a");
    ASSERT_TRUE(first.ok());
    ASSERT_TRUE(first->write("first").ok());
    const auto second = OutputFile::create(folder_ / "a");
    ASSERT_FALSE(second.ok());
    EXPECT_NE(second.status().message().find("another"), std::string::npos) << second.status().message();
    ASSERT_TRUE(first->commit().ok());
    EXPECT_EQ(read_file(folder_ / "a"), "first");
}

TEST_F(BaseFiles, EveryOperationCanFailAndLeavesTheOldFile) {
    folder_.write("a", "old");
    int failed = 0;
    for (int n = 1;; n++) {
        disk_.error_number = ENOSPC;
        disk_.fail_any_in = n;
        const Status status = write_text(folder_ / "a", "new");
        const bool met = disk_.fail_any_in <= 0;
        disk_.clear();
        EXPECT_EQ(status.ok(), !met);
        EXPECT_EQ(read_file(folder_ / "a"), met ? "old" : "new");
        EXPECT_EQ(folder_.files().size(), 1u) << "a temporary file is left";
        if (!met) break;
        EXPECT_NE(status.message().find("No space left"), std::string::npos) << status.message();
        failed++;
    }
    EXPECT_EQ(failed, 4);  // create, write, sync, rename
}

TEST_F(BaseFiles, AGrowingFileHoldsWholeRows) {
    auto log = GrowingFile::create(folder_ / "log");
    ASSERT_TRUE(log.ok());
    EXPECT_TRUE(log->append("one\n").ok());
    EXPECT_EQ(read_file(folder_ / "log"), "one\n");
    // The row after the first: half of it arrives, the other half does not.
    disk_.one_short_in = 1;
    disk_.fail_write_in = 2;
    disk_.error_number = ENOSPC;
    EXPECT_FALSE(log->append("two, which is longer\n").ok());
    EXPECT_EQ(read_file(folder_ / "log"), "one\n");
    EXPECT_TRUE(log->append("three\n").ok()) << "short writes go on";
    EXPECT_EQ(read_file(folder_ / "log"), "one\nthree\n");
}

TEST_F(BaseFiles, GoThroughTheFileSystemThatIsInPlace) {
    disk_.error_number = ENOSPC;
    disk_.fail_any_in = 1;
    {
        support::FailingFileSystem other;
        EXPECT_TRUE(write_text(folder_ / "a", "one").ok());
        other.error_number = EIO;
        other.fail_any_in = 1;
        EXPECT_FALSE(write_text(folder_ / "a", "two").ok());
    }
    EXPECT_EQ(disk_.fail_any_in, 1) << "asked while another was in its place";
    EXPECT_FALSE(write_text(folder_ / "a", "three").ok());
    EXPECT_EQ(read_file(folder_ / "a"), "one");
}

TEST_F(BaseFiles, APipeIsRefusedNotWaitedFor) {
    ASSERT_EQ(::mkfifo((folder_ / "pipe").c_str(), 0600), 0);
    const auto file = InputFile::open(folder_ / "pipe");
    ASSERT_FALSE(file.ok());
    EXPECT_NE(file.status().message().find("not a regular file"), std::string::npos) << file.status().message();
}

TEST_F(BaseFiles, ReadsGoOnAfterShortOnes) {
    const std::string content(100000, 'x');
    folder_.write("a", content);
    disk_.one_short_in = 2;
    disk_.longest_delay_us = 10;
    const auto text = read_text(folder_ / "a");
    ASSERT_TRUE(text.ok());
    EXPECT_EQ(*text, content);
}

class ScratchFiles : public BaseFiles, public testing::WithParamInterface<size_t> {};

TEST_P(ScratchFiles, TakeFromManyThreads) {
    auto file = SpillFile::create(folder_ / "scene.rpb", GetParam());
    ASSERT_TRUE(file.ok()) << file.status().message();
    std::vector<uint64_t> offsets(500);
    const auto contents = [](size_t i) { return std::vector<std::byte>(1 + i * 37003 % 500000, std::byte(i % 251)); };
    ASSERT_TRUE(parallel_try(offsets.size(), 1, [&](size_t i, size_t) {
                    const auto offset = (*file)->append(contents(i));
                    if (offset) offsets[i] = *offset;
                    return offset.status();
                }).ok());
    for (size_t i = 0; i < offsets.size(); i++) {
        std::vector<std::byte> read(contents(i).size());
        ASSERT_TRUE((*file)->read(offsets[i], read).ok());
        EXPECT_TRUE(read == contents(i)) << i;
    }
}

// Neighbours stay as they are where space is given back.
TEST_P(ScratchFiles, GiveSpaceBack) {
    auto file = SpillFile::create(folder_ / "scene.rpb", GetParam());
    ASSERT_TRUE(file.ok()) << file.status().message();
    std::vector<std::byte> bytes(size_t{20} << 20);
    for (size_t i = 0; i < bytes.size(); i++) bytes[i] = std::byte(i * 2654435761u >> 24);
    ASSERT_TRUE((*file)->append(bytes).ok());
    const uint64_t begin = (3 << 20) + 12345, end = (17 << 20) - 54321;
    (*file)->discard(begin, end - begin);
    for (const auto& [from, to] : {std::pair<uint64_t, uint64_t>(0, begin), std::pair<uint64_t, uint64_t>(end, bytes.size())}) {
        std::vector<std::byte> read(to - from);
        ASSERT_TRUE((*file)->read(from, read).ok());
        EXPECT_TRUE(std::ranges::equal(read, std::span(bytes).subspan(from, to - from))) << from;
    }
    EXPECT_FALSE((*file)->read(bytes.size() - 1, std::span(bytes).first(2)).ok()) << "beyond the end";
}

INSTANTIATE_TEST_SUITE_P(OfFiles, ScratchFiles, testing::Values(size_t{1}, size_t{3}, SpillFile::for_all_threads));

}  // namespace
}  // namespace raypager
