// How changes of the page table are cut into launches (wavefront/page_changes.hpp).
#include "wavefront/page_changes.hpp"

#include <gtest/gtest.h>

#include <numeric>

namespace raypager {
namespace {

std::vector<rp_page> changes_of(uint32_t count) {
    std::vector<rp_page> changes;
    for (uint32_t i = 0; i < count; i++) changes.push_back({7 * i, i, i + 1, 1000 + i});
    return changes;
}

std::vector<uint32_t> entries_in(const rp_page_changes& changes) {
    std::vector<uint32_t> entries;
    for (const rp_page& page : changes.pages) {
        if (page.block == RP_NONE) break;
        EXPECT_EQ(page.address, 7 * (page.block - 1000));
        entries.push_back(page.block);
    }
    return entries;
}

TEST(PageChanges, all_come_once_and_in_order) {
    for (const uint32_t count : {0u, 1u, 47u, 48u, 49u, 96u, 97u, 400u}) {
        for (const uint32_t blocks : {0u, 1u, 16u, 17u, 200u}) {
            SCOPED_TRACE(testing::Message() << count << " changes, " << blocks << " blocks that came");
            const uint32_t table = 4000;
            std::vector<uint32_t> came(blocks);
            std::iota(came.begin(), came.end(), 1000);
            const std::vector<rp_page> changes = changes_of(count);
            const std::vector<RoundBegin> launches = round_begins(changes, came, table);
            ASSERT_FALSE(launches.empty());
            std::vector<uint32_t> entries;
            for (const RoundBegin& launch : launches) {
                const std::vector<uint32_t> here = entries_in(launch.changes);
                entries.insert(entries.end(), here.begin(), here.end());
                EXPECT_TRUE(launch.named == 0 || &launch == &launches.back());
            }
            std::vector<uint32_t> all(count);
            std::iota(all.begin(), all.end(), 1000);
            EXPECT_EQ(entries, all);
            const RoundBegin& last = launches.back();
            if (blocks > RP_MAX_NAMED) {
                // It reads the table: nothing of that may change meanwhile.
                EXPECT_EQ(last.named, RP_NONE);
                EXPECT_TRUE(entries_in(last.changes).empty());
                EXPECT_EQ(launches.size(), 1 + (count + RP_PAGE_CHANGES - 1) / RP_PAGE_CHANGES);
            } else {
                EXPECT_EQ(last.named, blocks);
                EXPECT_TRUE(std::equal(came.begin(), came.end(), last.names.begin()));
                EXPECT_EQ(launches.size(), std::max(1u, (count + RP_PAGE_CHANGES - 1) / RP_PAGE_CHANGES));
            }
        }
    }
}

// In a large table it takes less time to name more blocks than a launch has room for.
TEST(PageChanges, many_are_named_where_asking_takes_long) {
    std::vector<uint32_t> came(5 * RP_MAX_NAMED + 3);
    std::iota(came.begin(), came.end(), 1000);
    for (const uint32_t count : {0u, 5u, 48u, 200u}) {
        SCOPED_TRACE(count);
        std::vector<uint32_t> names, entries;
        for (const RoundBegin& launch : round_begins(changes_of(count), came, 1'000'000)) {
            ASSERT_LE(launch.named, RP_MAX_NAMED);
            names.insert(names.end(), launch.names.begin(), launch.names.begin() + launch.named);
            const std::vector<uint32_t> here = entries_in(launch.changes);
            entries.insert(entries.end(), here.begin(), here.end());
        }
        EXPECT_EQ(names, came);
        EXPECT_EQ(entries.size(), count);
    }
    EXPECT_EQ(round_begins({}, came, 4096 * 4).back().named, RP_NONE);
    EXPECT_EQ(round_begins({}, came, 4096 * 5).size(), 6u);
}

}  // namespace
}  // namespace raypager
