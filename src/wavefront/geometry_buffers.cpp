#include "wavefront/geometry_buffers.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "block/wide_top.hpp"

namespace raypager {
namespace {

// A stack holds: the exit, one entry a level of the top tree, the return from a block, one entry a level of its tree; and all but the first again for
// each level of instances.
constexpr uint32_t stack_in_world = RP_TOP_MAX_DEPTH + 1 + RP_BLOCK_MAX_DEPTH + 2;
uint32_t stack_size(const BakedScene& scene) { return 1 + (1 + scene.instance_levels()) * stack_in_world; }

uint64_t demand_bytes(const BakedScene& scene, BlockForm form) {
    const uint64_t blocks = scene.pageable_count();
    return at_least_16((form == BlockForm::wide ? RP_DEMAND_WORDS_OF_STREAMS(blocks) : RP_DEMAND_WORDS(blocks)) * sizeof(uint32_t));
}

// What single rays have on the device (abi/block.h, rp_block_entry).
struct DeviceTop {
    rp_top_grid grid;
    std::vector<rp_node> nodes;
    std::vector<rp_block_entry> block_entries;
    std::vector<rp_object> objects;
};

DeviceTop device_top(const BakedScene& scene) {
    DeviceTop top{scene.top_grid, scene.top_nodes, scene.block_entries, scene.objects};
    const size_t block_entries = scene.block_entries.size();
    if (block_entries + scene.blocks.size() >= (RP_REF_END & ~RP_REF_BLOCK_ENTRY)) return top;  // more than references can tell apart
    top.block_entries.resize(block_entries + scene.blocks.size());
    std::vector<uint32_t> block_entries_of(scene.blocks.size());
    for (const rp_block_entry& block_entry : scene.block_entries) {
        block_entries_of[block_entry.block]++;
        top.block_entries[block_entries + block_entry.block] = block_entry;
    }
    // The block that all block entries beneath a reference belong to, or RP_NONE, and how many these are.
    struct Beneath {
        uint32_t block, block_entries;
    };
    std::vector<Beneath> of_node(scene.top_nodes.size());
    const auto beneath = [&](rp_u32 ref) {
        return ref >= RP_REF_BLOCK_ENTRY ? Beneath{scene.block_entries[ref & ~RP_REF_BLOCK_ENTRY].block, 1} : of_node[ref];
    };
    const auto enter_whole = [&](rp_u32& ref) {
        if (ref >= RP_REF_BLOCK_ENTRY) return;
        const uint32_t block = of_node[ref].block;
        if (block == RP_NONE || of_node[ref].block_entries != block_entries_of[block]) return;
        rp_block_entry& record = top.block_entries[block_entries + block];
        record.root = ref;
        ref = RP_REF_BLOCK_ENTRY | static_cast<rp_u32>(block_entries + block);
    };
    // Children come after their parents.
    for (size_t i = scene.top_nodes.size(); i-- > 0;) {
        const Beneath left = beneath(scene.top_nodes[i].child[0].ref), right = beneath(scene.top_nodes[i].child[1].ref);
        of_node[i] = left.block == right.block ? Beneath{left.block, left.block_entries + right.block_entries} : Beneath{RP_NONE, 0};
        for (rp_child& child : top.nodes[i].child) enter_whole(child.ref);
    }
    enter_whole(top.grid.root);
    for (rp_object& object : top.objects) enter_whole(object.top.root);
    return top;
}

WideTop wide_top(const BakedScene& scene) {
    return make_wide_top(scene.top_grid, scene.objects, scene.top_nodes, scene.block_entries, scene.wide_roots);
}

}  // namespace

uint64_t GeometryBuffers::bytes(const BakedScene& scene, BlockForm form) {
    const uint64_t tree = form == BlockForm::wide ? wide_top(scene).bytes.size() + 2 * at_least_16(0)
                                                  : at_least_16(scene.top_nodes.size() * sizeof(rp_node)) +
                                                        at_least_16(scene.block_entry_paths.size() * sizeof(uint64_t));
    const uint64_t block_entries = scene.block_entries.size() + (form == BlockForm::stored ? scene.blocks.size() : 0);
    const uint64_t objects = scene.instances > 0 ? scene.objects.size() * sizeof(rp_object) : 0;
    return tree + at_least_16(block_entries * sizeof(rp_block_entry)) + objects + demand_bytes(scene, form);
}

Result<GeometryBuffers> GeometryBuffers::create(Device& device, const BakedScene& scene, BlockForm form, const std::vector<Buffer>& slabs,
                                                const Buffer& page_table, bool cutouts, const std::string& film_definitions) {
    GeometryBuffers result;
    result.variants_ = film_definitions;
    result.form_ = form;
    result.slabs_ = &slabs;
    result.page_table_ = &page_table;
    result.block_count_ = scene.pageable_count();
    result.has_objects_ = scene.instances > 0;
    if (result.has_objects_) result.variants_ += "-DRP_INSTANCES ";
    if (scene.instance_levels() > 1) result.variants_ += fmt::format("-DRP_INSTANCE_LEVELS={} ", scene.instance_levels());
    result.stack_size_ = stack_size(scene);
    if (scene.position_cell > 0) result.variants_ += "-DRP_CODED_POSITIONS ";
    if (scene.spheres == 0) result.variants_ += "-DRP_ONLY_TRIANGLES ";
    if (scene.has_vertex_colors()) result.variants_ += "-DRP_VERTEX_COLORS ";
    if (scene.has_textures()) result.variants_ += "-DRP_TEXTURES ";
    if (scene.has_tangents()) result.variants_ += "-DRP_TANGENTS ";
    if (cutouts && scene.has_cutouts()) result.variants_ += "-DRP_CUTOUTS ";
    if (scene.has_uvs()) result.variants_ += "-DRP_UVS ";
    if (scene.has_traits()) result.variants_ += "-DRP_TRAITS ";
    const bool wide = form == BlockForm::wide;
    const WideTop top = wide ? wide_top(scene) : WideTop();
    DeviceTop single = wide ? DeviceTop{scene.top_grid, {}, {}, scene.objects} : device_top(scene);
    for (size_t i = 0; wide && i < single.objects.size(); i++) single.objects[i].top.root = top.object_roots[i];
    result.top_grid_ = single.grid;
    struct Part {
        Buffer& buffer;
        std::span<const std::byte> contents;
        const char* what;
    };
    // Streams have the wide top tree instead of the nodes and the paths through them.
    const Part parts[] = {{result.top_nodes_, bytes_of(single.nodes), "the top tree"},
                          {result.block_entries_, wide ? bytes_of(top.block_entries) : bytes_of(single.block_entries), "block entries"},
                          {result.block_entry_paths_, wide ? std::span<const std::byte>() : bytes_of(scene.block_entry_paths), "block entry paths"}};
    for (const Part& part : parts) {
        auto buffer = device.upload(part.contents, part.what);
        if (!buffer) return buffer.status();
        part.buffer = std::move(*buffer);
    }
    if (result.has_objects_) {
        auto objects = device.upload(bytes_of(single.objects), "objects");
        if (!objects) return objects.status();
        result.objects_ = std::move(*objects);
    }
    if (wide) {
        auto tree = device.upload(top.bytes, "the wide top tree");
        if (!tree) return tree.status();
        result.wide_top_ = std::move(*tree);
    }
    auto demand = device.allocate(demand_bytes(scene, form), "demand counters");
    if (!demand) return demand.status();
    result.demand_ = std::move(*demand);
    RAYPAGER_TRY(device.kernels().fill_zero(result.demand_, 0, result.demand_.bytes()));
    return result;
}

std::string GeometryBuffers::definitions() const {
    return variants_ + fmt::format("-DRP_SLABS={} -DRP_STACK_SIZE={}", slabs_->size() == 1 ? 1 : RP_MAX_SLABS, stack_size_);
}

KernelName GeometryBuffers::kernel_name(const Device& device, const std::string& name, uint32_t registers,
                                        const std::string& more_definitions) const {
    const bool wide = form_ == BlockForm::wide;
    return {(wide ? "stream/" : "single_ray/") + name, "rp_" + name + (wide ? "_stream" : ""),
            device.register_limit(registers) + definitions() + more_definitions};
}

Status GeometryBuffers::launch(Device& device, Queue& queue, const Kernel& kernel, uint64_t rays, Event* event) const {
    const uint64_t units = device.info().compute_units;
    // Each alone in its group: it has much private memory.
    if (form_ == BlockForm::wide) return queue.launch(kernel, units * device.profile().stream_items, 1, event);
    return queue.launch(kernel, std::min(rays, units * device.profile().ray_items), device.group_size(), event);
}

}  // namespace raypager
