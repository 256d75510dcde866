#include "support/render_edited.hpp"

#include <algorithm>
#include <memory>
#include <span>

#include "base/check.hpp"
#include "block/decode.hpp"
#include "block/wide_block.hpp"
#include "render/render.hpp"
#include "texture/texture_words.hpp"

namespace raypager::support {
namespace {

// As many primitives as the table of blocks says.
void decode(const BakedScene& scene, uint32_t block, std::span<const std::byte> stored) {
    const BlockView view(stored);
    uint64_t primitives = 0;
    for (const rp_u32 root : scene.block_entries_of(block).roots) {
        const DecodedLeaf leaf = decode_subtree(view, root);
        primitives += leaf.triangles.size() + leaf.spheres.size();
    }
    RAYPAGER_CHECK(primitives == uint64_t{scene.blocks[block].triangles} + scene.blocks[block].spheres);
}

// In memory of just the block's size, so that sanitizers see who reads behind it; not cleared, which would take as long as all checks.
bool verify_block(const BlockFile& file, uint32_t block) {
    const BlockRecord& record = file.scene().blocks[block];
    const auto memory = std::make_unique_for_overwrite<std::byte[]>(record.stored_bytes);
    const std::span stored(memory.get(), record.stored_bytes);
    if (!file.read_block(block, stored) || !file.check_block(block, stored)) return false;
    if (record.instances == 0) decode(file.scene(), block, stored);
    // As transcode_block() has it.
    const BlockEntryRoots block_entries = file.scene().block_entries_of(block);
    WideBlockMaker maker;
    return maker.make(stored, block_entries.roots).size() == record.wide_bytes && std::ranges::equal(maker.roots(), block_entries.wide_roots);
}

}  // namespace

bool verify_all(const BlockFile& file) {
    const BakedScene& scene = file.scene();
    const auto texels = std::make_unique_for_overwrite<std::byte[]>(RP_TEXTURE_PAGE_BYTES);
    for (uint32_t page = 0; page < scene.pages.size(); page++)
        if (!file.read_page(page, std::span(texels.get(), RP_TEXTURE_PAGE_BYTES))) return false;
    (void)texture_words(scene);
    bool good = true;
    for (uint32_t block = 0; block < scene.blocks.size(); block++) good = verify_block(file, block) && good;
    return good;
}

Status render_edited(const BlockFile& file, uint64_t choice) {
    RenderOptions options;
    options.width = 8;
    options.height = 6;
    options.spp = 1;
    options.max_depth = 4;
    options.memory_limit = uint64_t{100} << 20;
    options.host_limit = uint64_t{16} << 20;
    options.tuning.paths = 64;
    if (choice & 1) options.geometry_limit_percent = 0.001;
    if (choice & 2) options.tuning.traversal = Traversal::ray;
    RenderCallbacks callbacks;
    callbacks.warning = [](const std::string&) {};
    return render(file, options, callbacks).status();
}

}  // namespace raypager::support
