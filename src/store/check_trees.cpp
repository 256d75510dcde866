#include "store/check_trees.hpp"

#include <fmt/format.h>

#include <vector>

#include "block/coordinates.hpp"
#include "store/format.hpp"
#include "store/section_status.hpp"

namespace raypager {
namespace {

using namespace format;

class TreeCheck {
public:
    explicit TreeCheck(const BakedScene& scene) : scene_(scene), seen_(scene.block_entries.size()) {}

    // Block entries of objects come first, nodes of the world do.
    Status run() {
        uint64_t of_objects = 0;
        for (const rp_object& object : scene_.objects) of_objects += object.top.block_entry_count;
        const uint64_t all = scene_.block_entries.size();
        if (of_objects > all) return bad_section(objects, "they have more block entries than there are");
        RAYPAGER_TRY(walk(scene_.top_grid.root, of_objects, all - of_objects));
        RAYPAGER_TRY(check_order(of_objects, all - of_objects, scene_.instance_levels()));
        uint64_t first = 0;
        for (size_t i = 0; i < scene_.objects.size(); i++) {
            const rp_object& object = scene_.objects[i];
            if (!good(object)) return bad_section(objects, fmt::format("the grid or the middle of object {} makes no sense", i));
            RAYPAGER_TRY(walk(object.top.root, first, object.top.block_entry_count));
            RAYPAGER_TRY(check_order(first, object.top.block_entry_count, object.levels));
            first += object.top.block_entry_count;
            if (first > 0 && first < all && scene_.block_entries[first - 1].block == scene_.block_entries[first].block)
                return bad_section(objects, fmt::format("object {} shares a block with what follows", i));
        }
        if (nodes_ != scene_.top_nodes.size()) return bad_section(top_nodes, "some nodes are never reached");
        return {};
    }

private:
    static bool good(const rp_object& object) {
        bool good = object.levels < RP_INSTANCE_MAX_LEVELS && is_stored_grid(object.top.origin, object.top.cell);
        for (const float coordinate : object.base) good = good && is_stored_coordinate(coordinate);
        return good;
    }

    // Of the world or an object, blocks of instances are the last. levels: of instances in it.
    Status check_order(uint64_t first, uint64_t count, uint32_t levels) const {
        bool instances = false;
        for (uint64_t i = first; i < first + count; i++) {
            const BlockRecord& block = scene_.blocks[scene_.block_entries[i].block];
            const bool of_instances = block.instances > 0;
            if (block.levels != (of_instances ? levels : 0))
                return bad_section(blocks, fmt::format("block {} has the wrong number of levels", scene_.block_entries[i].block));
            if (instances && !of_instances) return bad_section(block_entries, fmt::format("block entry {} comes behind those of instances", i));
            instances = of_instances;
        }
        return {};
    }

    struct Entry {
        rp_u32 ref;
        int depth;
        uint64_t path;
    };

    // One tree: each of its nodes and `count` block entries is reached once, within the depth, and by the path that the block entry names.
    Status walk(rp_u32 root, uint64_t first, uint64_t count) {
        if (count == 0) return root == RP_REF_EXIT ? Status() : bad_section(top_nodes, "there is a tree but no block entry");
        std::vector<Entry> stack = {{root, 0, 1}};
        uint64_t reached = 0;
        while (!stack.empty()) {
            const Entry entry = stack.back();
            stack.pop_back();
            if ((entry.ref & RP_REF_BLOCK_ENTRY) == RP_REF_BLOCK_ENTRY) {
                RAYPAGER_TRY(reach(entry, first, count));
                reached++;
                continue;
            }
            // Depth-first order, tree after tree: a node's number is the number of nodes met before it. So there can be no cycle.
            if (entry.ref != nodes_ || nodes_ >= scene_.top_nodes.size())
                return bad_section(top_nodes, fmt::format("node {} is absent or out of order", entry.ref));
            if (entry.depth == RP_TOP_MAX_DEPTH) return bad_section(top_nodes, "the tree is too deep");
            for (const uint64_t side : {1, 0}) {
                const rp_child& child = scene_.top_nodes[nodes_].child[side];
                if (!is_stored_box(child)) return bad_section(top_nodes, fmt::format("the boxes of node {} make no sense", nodes_));
                stack.push_back({child.ref, entry.depth + 1, entry.path << 1 | side});
            }
            nodes_++;
        }
        return reached == count ? Status() : bad_section(top_nodes, "some block entries are never reached");
    }

    Status reach(const Entry& entry, uint64_t first, uint64_t count) {
        const uint32_t block_entry = entry.ref & ~RP_REF_BLOCK_ENTRY;
        if (block_entry < first || block_entry - first >= count || seen_[block_entry])
            return bad_section(top_nodes, fmt::format("block entry {} is absent, of another tree, or reached twice", block_entry));
        if (scene_.block_entry_paths[block_entry] != entry.path)
            return bad_section(block_entry_paths, fmt::format("the path of block entry {} leads elsewhere", block_entry));
        seen_[block_entry] = true;
        return {};
    }

    const BakedScene& scene_;
    std::vector<bool> seen_;
    size_t nodes_ = 0;  // met so far
};

}  // namespace

Status check_trees(const BakedScene& scene) { return TreeCheck(scene).run(); }

}  // namespace raypager
