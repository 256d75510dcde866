// Records of primitives on disk: what is written is what is read.
#include <gtest/gtest.h>

#include <atomic>
#include <cstring>
#include <vector>

#include "base/files.hpp"
#include "support/temporary_folder.hpp"
#include "world/records.hpp"

namespace raypager {
namespace {

using support::TemporaryFolder;

// Buffers that fill up little by little, and many records that pass them by.
TEST(BucketWriter, GivesBackHoweverManyRecordsComeAtOnce) {
    const TemporaryFolder folder;
    auto file = SpillFile::create(folder / "scene.rpb", SpillFile::for_all_threads);
    ASSERT_TRUE(file.ok());
    BucketWriter writer(std::move(*file), size_t{64} << 10);
    std::vector<SphereRecord> records(300000);
    for (uint32_t i = 0; i < records.size(); i++) records[i] = {{{1.0f * static_cast<float>(i), 2, 3}, 4}, i};
    size_t given = 0;
    for (const size_t count : std::initializer_list<size_t>{1, 100000, 2000, 2730, 730, 5460, 100, 20000, 150000, 18979}) {
        ASSERT_TRUE(writer.add(sphere_records, std::as_bytes(std::span(records).subspan(given, count))).ok());
        given += count;
    }
    ASSERT_EQ(given, records.size());
    const auto bucket = writer.finish();
    ASSERT_TRUE(bucket.ok());
    ASSERT_EQ(bucket->primitives(), records.size());
    std::vector<SphereRecord> read(1000);
    for (size_t first = 0; first < records.size(); first += 1000) {
        ASSERT_TRUE(bucket->read(sphere_records, first, std::as_writable_bytes(std::span(read))).ok());
        for (size_t i = 0; i < read.size(); i++) ASSERT_EQ(read[i].id, first + i);
    }
    std::atomic<size_t> seen{0};
    const auto see = [&](uint64_t first, std::span<const std::byte> bytes) {
        EXPECT_EQ(std::memcmp(bytes.data(), &records[first], bytes.size()), 0) << first;
        seen += bytes.size() / sizeof(SphereRecord);
    };
    ASSERT_TRUE(bucket->for_each_in_parallel(sphere_records, 10000, see).ok());
    EXPECT_EQ(seen, records.size());
}

}  // namespace
}  // namespace raypager
