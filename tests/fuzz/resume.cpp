// Checkpoints in which fields are changed (tests/support/edited_files.hpp): checksums and sizes are right. The first byte of an input says which
// checkpoint, the rest what is changed. Each is opened and its film read; one in some hundreds of those that are good for a render
// (fuzz/support/choose) is rendered on from.
#include "base/check.hpp"
#include "fuzz/fuzz.hpp"
#include "fuzz/support/choose.hpp"
#include "raypager/bake.hpp"
#include "render/checkpoint.hpp"
#include "support/edited_files.hpp"
#include "support/interrupted_render.hpp"
#include "support/small_scene.hpp"
#include "support/temporary_folder.hpp"

namespace raypager::fuzz {
namespace {

struct GoodCheckpoint {
    support::TestOptions options;
    std::string bytes;
    RenderIdentity identity;
};

// A render that was stopped, in groups of samples or pass by pass, and an adaptive one that was, behind its first stage.
struct StoppedRenders {
    std::shared_ptr<const BlockFile> scene;
    std::vector<GoodCheckpoint> checkpoints;

    StoppedRenders() {
        BakeOptions bake_options;
        bake_options.block_bytes = 16 << 10;
        RAYPAGER_CHECK(bake(support::small_scene(12), bake_options, scratch_path("scene.rpb")).ok());
        scene = *BlockFile::open(scratch_path("scene.rpb"));
        for (const uint32_t together : {1u, 4u}) add(together, 0);
        add(1, 0.05);
    }

    void add(uint32_t together, double adaptive_error) {
        GoodCheckpoint good;
        good.options.spp = adaptive_error > 0 ? 64 : 6;
        good.options.tuning.paths = 64;
        good.options.tuning.together = together;
        good.options.adaptive_error = adaptive_error;
        good.options.checkpoint.file = scratch_path("good.ckpt");
        std::filesystem::remove(good.options.checkpoint.file);
        RAYPAGER_CHECK(support::render_rounds(*scene, good.options, adaptive_error > 0 ? 60 : 4).ok());
        good.bytes = support::read_file(good.options.checkpoint.file);
        const auto file = CheckpointFile::open(good.options.checkpoint.file);
        RAYPAGER_CHECK(file.ok());
        good.identity = file->state().identity;
        good.options.checkpoint.resume = true;
        checkpoints.push_back(std::move(good));
    }
};

const StoppedRenders& stopped() {
    static const StoppedRenders renders;
    return renders;
}

}  // namespace

std::vector<std::string> seeds() {
    std::vector<std::string> result;
    for (size_t kind = 0; kind < stopped().checkpoints.size(); kind++)
        for (uint64_t seed = 0; seed < 10; seed++) result.push_back(static_cast<char>(kind) + support::random_edits(seed));
    return result;
}

void run(std::string_view input) {
    if (input.empty()) return;
    const GoodCheckpoint& good = stopped().checkpoints[static_cast<uint8_t>(input[0]) % stopped().checkpoints.size()];
    std::string bytes = good.bytes;
    support::edit_checkpoint(bytes, input.substr(1, 8 * support::edit_bytes));
    const std::filesystem::path path = write_input("input.ckpt", bytes);
    {
        const auto file = CheckpointFile::open(path);
        if (!file) return RAYPAGER_CHECK(file.status().message().find("input.ckpt") != std::string::npos);
        check_proportion(file->state().gaps.capacity() * sizeof(SampleRange) + file->state().samples.capacity() * sizeof(rp_path_sample), bytes, 1);
        if (!file->check(good.identity, good.options.spp)) return;
        if (!file->read_film([](uint64_t, std::span<const uint32_t>) { return Status(); })) return;
    }
    if (!is_rendered(input)) return;
    support::TestOptions options = good.options;
    options.checkpoint.file = path;
    RenderCallbacks callbacks;
    callbacks.warning = [](const std::string&) {};  // of another device, say
    const auto rendered = render(*stopped().scene, options, callbacks);
    RAYPAGER_CHECK(rendered.ok() || rendered.status().message().find('\n') == std::string::npos);
}

}  // namespace raypager::fuzz
