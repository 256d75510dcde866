// Parts of the world -> blocks in the file.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "blocks/bake.hpp"
#include "blocks/pack.hpp"
#include "blocks/top_tree.hpp"
#include "blocks/world.hpp"
#include "blocks/world_cut.hpp"
#include "store/block_file.hpp"

namespace raypager {

class BlockBuilder {
public:
    // options.block_bytes is set. builders: blocks that are made at a time.
    BlockBuilder(const BakeOptions& options, size_t builders, BlockFileWriter& writer, BakedScene& baked)
        : options_(options), builders_(builders), writer_(writer), baked_(baked) {}
    // Builds a block of each part, or several where its bytes were underestimated, and appends them in order.
    Status build(const World& world, const Weigher& weigher, const WorldParts& parts, const std::function<void(double)>& progress);
    // Of all portals so far.
    const std::vector<PortalBox>& portal_boxes() const { return portal_boxes_; }

private:
    class Run;
    Status append(PackedBlock& block);

    const BakeOptions& options_;
    const size_t builders_;
    BlockFileWriter& writer_;
    BakedScene& baked_;
    std::vector<PortalBox> portal_boxes_;
};

}  // namespace raypager
