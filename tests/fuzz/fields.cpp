// Block files in which fields are changed (tests/support/edited_files.hpp): checksums and sizes are right, so that it is the reader's and the
// engine's own checks that stand between a field and a kernel. The first byte of an input says which file, the rest what is changed. Each file is
// opened, all of it is verified and decoded; one in some hundreds of those that pass (RENDER_EVERY=N: in N) is rendered with room for the largest
// block alone.
#include "base/check.hpp"
#include "base/hash.hpp"
#include "fuzz/fuzz.hpp"
#include "fuzz/support/choose.hpp"
#include "support/edited_files.hpp"
#include "support/render_edited.hpp"
#include "support/temporary_folder.hpp"
#include "unit/varied_scenes.hpp"

namespace raypager::fuzz {
namespace {

const std::vector<std::string>& good_files() {
    static const std::vector<std::string> files = [] {
        std::vector<std::string> made;
        for (const blocks_test::VariedFile& file : blocks_test::varied_files()) {
            const std::filesystem::path path = scratch_path("good.rpb");
            RAYPAGER_CHECK(bake(file.scene, file.options, path).ok());
            made.push_back(support::read_file(path));
        }
        return made;
    }();
    return files;
}

}  // namespace

std::vector<std::string> seeds() {
    std::vector<std::string> result;
    for (size_t file = 0; file < good_files().size(); file++)
        for (uint64_t seed = 0; seed < 25; seed++) result.push_back(static_cast<char>(file) + support::random_edits(seed));
    return result;
}

void run(std::string_view input) {
    if (input.empty()) return;
    std::string bytes = good_files()[static_cast<uint8_t>(input[0]) % good_files().size()];
    support::edit_block_file(bytes, input.substr(1, 8 * support::edit_bytes));
    const auto file = BlockFile::open(write_input("input.rpb", bytes));
    if (!file) return RAYPAGER_CHECK(file.status().message().find("input.rpb") != std::string::npos);
    if (!support::verify_all(**file) || !is_rendered(input)) return;
    const auto rendered = support::render_edited(**file, hash64(input) / 7919);
    RAYPAGER_CHECK(rendered.ok() || rendered.message().find('\n') == std::string::npos);
}

}  // namespace raypager::fuzz
