#include "raypager/blocks.hpp"

#include "base/check.hpp"
#include "store/block_file.hpp"

namespace raypager {

Result<Blocks> Blocks::open(const std::filesystem::path& path) {
    auto file = BlockFile::open(path);
    if (!file) return file.status();
    return Blocks(std::move(*file));
}

const Camera& Blocks::camera() const { return source_->scene().camera; }
uint32_t Blocks::width() const { return source_->scene().width; }
uint32_t Blocks::height() const { return source_->scene().height; }
uint32_t Blocks::spp() const { return source_->scene().spp; }
uint32_t Blocks::max_depth() const { return source_->scene().max_depth; }
std::array<float, 3> Blocks::lower() const { return std::to_array(source_->scene().lower); }
std::array<float, 3> Blocks::upper() const { return std::to_array(source_->scene().upper); }
uint64_t Blocks::triangles() const { return source_->scene().triangles; }
uint64_t Blocks::spheres() const { return source_->scene().spheres; }
uint32_t Blocks::count() const { return static_cast<uint32_t>(source_->scene().blocks.size()); }
uint64_t Blocks::block_entries() const { return source_->scene().block_entries.size(); }
uint64_t Blocks::bytes(BlockForm form) const { return source_->scene().geometry_bytes(form); }
uint64_t Blocks::largest(BlockForm form) const { return source_->scene().largest_block(form); }
uint32_t Blocks::images() const { return static_cast<uint32_t>(source_->scene().images.size()); }
uint32_t Blocks::pages() const { return static_cast<uint32_t>(source_->scene().pages.size()); }
uint64_t Blocks::texture_bytes() const { return source_->scene().texture_bytes(); }
uint64_t Blocks::memory_bytes(BlockForm form) const { return source_->scene().memory_bytes(form); }

uint64_t Blocks::instances() const { return source_->scene().instances; }
uint32_t Blocks::materials() const { return static_cast<uint32_t>(source_->scene().materials.size()); }

// Block entries lie object by object, then those of the world, as blocks do.
uint32_t Blocks::first_block_in_world() const {
    const BakedScene& scene = source_->scene();
    uint64_t entry = 0;
    for (const rp_object& object : scene.objects) entry += object.top.block_entry_count;
    return entry < scene.block_entries.size() ? scene.block_entries[entry].block : count();
}

std::pair<std::array<float, 3>, std::array<float, 3>> Blocks::bounds(uint32_t block) const {
    RAYPAGER_CHECK(block < count());
    const BlockRecord& record = source_->scene().blocks[block];
    return {std::to_array(record.lower), std::to_array(record.upper)};
}

}  // namespace raypager
