// Fields of block files and checkpoints that make no sense, under right checksums: refused in one line, or rendered in whatever way.
// tests/fuzz/fields and tests/fuzz/resume do the same, guided and for as long as one likes.
#include "support/edited_files.hpp"

#include <gtest/gtest.h>

#include "base/files.hpp"
#include "render/checkpoint.hpp"
#include "support/interrupted_render.hpp"
#include "support/render_edited.hpp"
#include "support/thorough.hpp"
#include "unit/varied_scenes.hpp"

namespace raypager {
namespace {

class EditedFiles : public testing::Test {
protected:
    void expect_one_line(const Status& status) {
        if (status.ok()) return;
        EXPECT_NE(status.message().find("edited"), std::string::npos) << status.message();
        EXPECT_EQ(status.message().find('\n'), std::string::npos) << status.message();
    }

    // Opens, verifies and, as long as `renders` last, renders files in which fields are changed. Returns how many passed all checks.
    int try_edits(const std::string& good, uint64_t edits, int renders) {
        const std::filesystem::path path = folder_ / "edited.rpb";
        int passed = 0;
        for (uint64_t seed = 0; seed < edits; seed++) {
            SCOPED_TRACE(testing::Message() << "seed " << seed);
            std::string bytes = good;
            support::edit_block_file(bytes, support::random_edits(seed));
            EXPECT_TRUE(write_text(path, bytes).ok());
            const auto file = BlockFile::open(path);
            expect_one_line(file.status());
            if (!file || !support::verify_all(**file)) continue;
            passed++;
            if (renders-- > 0) expect_one_line(support::render_edited(**file, 1));
        }
        return passed;
    }

    support::TemporaryFolder folder_;
};

TEST_F(EditedFiles, that_pass_all_checks_are_rendered) {
    const int edits = support::thorough() ? 20000 : 500;
    int number = 0;
    for (const blocks_test::VariedFile& file : blocks_test::varied_files()) {
        SCOPED_TRACE(testing::Message() << "file " << number);
        ASSERT_TRUE(bake(file.scene, file.options, folder_ / "good.rpb").ok());
        // What takes kernels of its own is compiled for seconds: the first two have all that the others have.
        const int renders = support::thorough() ? 250 : number < 2 ? 15 : 0;
        const int passed = try_edits(support::read_file(folder_ / "good.rpb"), edits, renders);
        EXPECT_GT(passed, edits / 20);
        EXPECT_LT(passed, edits * 19 / 20);
        number++;
    }
}

TEST_F(EditedFiles, checkpoints_that_pass_all_checks_are_gone_on_from) {
    BakeOptions bake_options;
    bake_options.block_bytes = 16 << 10;
    ASSERT_TRUE(bake(support::small_scene(12), bake_options, folder_ / "scene.rpb").ok());
    const auto scene = BlockFile::open(folder_ / "scene.rpb");
    ASSERT_TRUE(scene.ok());
    support::TestOptions options;
    options.spp = 6;
    options.tuning.paths = 64;
    options.checkpoint.file = folder_ / "edited.ckpt";
    ASSERT_TRUE(support::render_rounds(**scene, options, 4).ok());
    const std::string good = support::read_file(options.checkpoint.file);
    RenderCallbacks callbacks;
    callbacks.warning = [](const std::string&) {};  // of another device, say
    options.checkpoint.resume = true;
    int refused = 0;
    const int edits = support::thorough() ? 3000 : 100;
    for (int seed = 0; seed < edits; seed++) {
        SCOPED_TRACE(testing::Message() << "seed " << seed);
        std::string bytes = good;
        support::edit_checkpoint(bytes, support::random_edits(static_cast<uint64_t>(seed)));
        ASSERT_TRUE(write_text(options.checkpoint.file, bytes).ok());
        const auto rendered = render(**scene, options, callbacks);
        expect_one_line(rendered.status());
        refused += !rendered.ok();
    }
    EXPECT_GT(refused, edits / 10);
    EXPECT_LT(refused, edits);
}

}  // namespace
}  // namespace raypager
