// Where files go: outputs checked before the work, caches beside the input or in the user's folder.
#include <gtest/gtest.h>

#include <cstdlib>

#include "base/files.hpp"
#include "cli/output_paths.hpp"
#include "cli/scene_cache.hpp"
#include "support/environment.hpp"
#include "support/temporary_folder.hpp"

namespace raypager {
namespace {

using support::ScopedVariable;

using Paths = std::vector<std::filesystem::path>;

class CliPaths : public testing::Test {
protected:
    const support::TemporaryFolder temporary_;
    const std::filesystem::path folder_ = temporary_.path();
};

TEST_F(CliPaths, OutputsNeedAFolderAndMustNotBeOne) {
    EXPECT_TRUE(check_output_path(folder_ / "new.exr").ok());
    ASSERT_TRUE(write_text(folder_ / "old.exr", "x").ok());
    EXPECT_TRUE(check_output_path(folder_ / "old.exr").ok()) << "an existing file may be replaced";
    EXPECT_TRUE(check_output_path("bare-name.exr").ok());
    for (const auto& wrong : {folder_, folder_ / "", folder_ / "absent" / "a.exr", folder_ / "old.exr" / "a.exr", std::filesystem::path()})
        EXPECT_FALSE(check_output_path(wrong).ok()) << wrong;
}

TEST_F(CliPaths, EndingsAreFoundInEitherCase) {
    EXPECT_TRUE(has_ending("a/b.rpb", ".rpb"));
    EXPECT_TRUE(has_ending("B.RPB", ".rpb"));
    for (const char* other : {"rpb", ".rpb", "a.rpbx", "a.rp", "a.rpb.gz", ""}) EXPECT_FALSE(has_ending(other, ".rpb")) << other;
}

TEST_F(CliPaths, SameFileUnderOtherNames) {
    ASSERT_TRUE(write_text(folder_ / "a", "x").ok());
    std::filesystem::create_symlink("a", folder_ / "link");
    EXPECT_TRUE(same_file(folder_ / "a", folder_ / "link"));
    EXPECT_TRUE(same_file(folder_ / "a", folder_ / "." / "a"));
    EXPECT_TRUE(same_file(folder_ / "absent", folder_ / "." / "absent"));
    EXPECT_TRUE(same_file("absent", "./absent"));
    EXPECT_FALSE(same_file(folder_ / "a", folder_ / "absent"));
    EXPECT_FALSE(same_file(folder_ / "absent", folder_ / "absent2"));
}

TEST_F(CliPaths, CachesLieBesideTheInputOrWithTheUser) {
    {
        const ScopedVariable cache("XDG_CACHE_HOME", "/somewhere/cache");
        EXPECT_EQ(cache_folders("scenes/a.pbrt", std::nullopt), (Paths{"scenes", "/somewhere/cache/raypager"}));
        EXPECT_EQ(cache_folders("a.pbrt", std::nullopt), (Paths{".", "/somewhere/cache/raypager"}));
        EXPECT_EQ(cache_folders("a.pbrt", "mine"), Paths{"mine"}) << "a folder that was asked for is not replaced by another";
    }
    const ScopedVariable cache("XDG_CACHE_HOME", "relative");  // to be ignored, says the XDG base directory specification
    {
        const ScopedVariable home("HOME", "/home/somebody");
        EXPECT_EQ(cache_folders("a.pbrt", std::nullopt), (Paths{".", "/home/somebody/.cache/raypager"}));
    }
    const ScopedVariable home("HOME", nullptr);
    EXPECT_EQ(cache_folders("a.pbrt", std::nullopt), Paths{"."});
}

}  // namespace
}  // namespace raypager
