#include "bench/export_groups.hpp"

#include <algorithm>
#include <vector>

#include "base/check.hpp"

namespace raypager::bench {

Groups::Groups(const BakedScene& scene) {
    // Scenes with objects are refused below.
    for (const rp_primitive_range& range : std::span(scene.ranges).first(scene.own_range_count())) {
        Group group;
        group.material = range.material;
        group.colored = (range.flags & RP_RANGE_POINT_COLOR) != 0;
        if (range.first_light != RP_NONE) {
            const rp_light& light = scene.lights[range.first_light];
            group.shines = true;
            group.radiance = {light.radiance[0], light.radiance[1], light.radiance[2]};
            two_sided_ = two_sided_ || (light.kind == RP_LIGHT_TRIANGLE && (light.flags & RP_LIGHT_TWO_SIDED) != 0);
        }
        const auto same = std::find_if(groups_.begin(), groups_.end(), [&](const Group& g) {
            return g.material == group.material && g.colored == group.colored && g.shines == group.shines && g.radiance == group.radiance;
        });
        first_primitive_.push_back(range.first_primitive);
        group_.push_back(static_cast<uint32_t>(same - groups_.begin()));
        if (same == groups_.end()) groups_.push_back(group);
    }
}

uint32_t Groups::of_primitive(uint32_t id) const {
    const auto after = std::upper_bound(first_primitive_.begin(), first_primitive_.end(), id);
    RAYPAGER_CHECK(after != first_primitive_.begin());
    return group_[static_cast<size_t>(after - first_primitive_.begin()) - 1];
}

Status for_each_part(const BlockFile& file, const std::function<Status(const DecodedLeaf& primitives)>& take) {
    if (!file.scene().objects.empty())
        return Status::failed(file.path().string() + ": it has instances, which cannot be exported; bake the scene with all of its shapes in place");
    const auto& blocks = file.scene().blocks;
    // The block entries of a block share it out among them.
    std::vector<std::vector<rp_u32>> roots(blocks.size());
    for (const rp_block_entry& block_entry : file.scene().block_entries) roots[block_entry.block].push_back(block_entry.root);
    std::vector<std::byte> stored;
    for (uint32_t block = 0; block < blocks.size(); ++block) {
        stored.resize(blocks[block].stored_bytes);
        RAYPAGER_TRY(file.read_block(block, stored));
        RAYPAGER_TRY(file.check_block(block, stored));
        const BlockView view(stored);
        for (const rp_u32 root : roots[block]) RAYPAGER_TRY(take(decode_subtree(view, root)));
    }
    return {};
}

}  // namespace raypager::bench
