#include "block/wide_block.hpp"

#include "base/check.hpp"
#include "block/wide_tree_writer.hpp"

namespace raypager {

std::span<const std::byte> WideBlockMaker::make(std::span<const std::byte> stored, std::span<const rp_u32> roots) {
    const StoredBlock block(stored);
    if (holds_instances(block.header)) {
        RAYPAGER_CHECK(roots.size() == 1);
        const auto bytes = instances_.make(block, stored, roots[0]);
        roots_.assign(1, instances_.root());
        return bytes;
    }
    const Tree tree = {block};
    plan_.make(tree, roots);
    WideTreeWriter writer(plan_.nodes(), plan_.collapse(), bytes_, [&](const BinaryNode& node, std::vector<std::byte>& bytes) {
        plan_.gathered(tree, node).append_to(bytes, block.header.block_index);
    });
    roots_.clear();
    for (const uint32_t root : plan_.roots()) roots_.push_back(writer.add_root(root));
    writer.finish(block.header.block_index, RP_NONE);
    return bytes_;
}

}  // namespace raypager
