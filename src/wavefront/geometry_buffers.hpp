// What kernels need to walk through a scene, beside the blocks themselves: the top tree and the demand counters on the device, and the
// argument list of kernels/common/geometry.cl.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "block/baked_scene.hpp"
#include "device/device.hpp"
#include "raypager/abi/block.h"
#include "raypager/abi/path.h"
#include "raypager/status.hpp"

namespace raypager {

// With this definition stages leave work to the next one that it can do as well (kernels/common/path_state.cl): surfaces at hits to
// `shade`, for one. Not with streams.
inline constexpr const char* short_states = " -DRP_SHORT_STATES";

// Bytes of a buffer: OpenCL has no empty ones.
constexpr uint64_t at_least_16(uint64_t bytes) { return bytes < 16 ? 16 : bytes; }

class GeometryBuffers {
public:
    static uint64_t bytes(const BakedScene& scene, BlockForm form);
    // slabs and page_table outlive this. form: of the blocks in the slabs. cutouts: false for who measures rays alone, and nothing has to be cut out.
    // film_definitions: FilmLayout::definitions().
    static Result<GeometryBuffers> create(Device& device, const BakedScene& scene, BlockForm form, const std::vector<Buffer>& slabs,
                                          const Buffer& page_table, bool cutouts = true, const std::string& film_definitions = {});

    const Buffer& pages() const { return *page_table_; }
    const Buffer& demand() const { return demand_; }       // abi/path.h, RP_DEMAND_WORDS
    uint32_t block_count() const { return block_count_; }  // entries of the page table: pages of images are among them
    // "-DNAME=VALUE ..." that kernels with RP_GEOMETRY_PARAMETERS are built with.
    std::string definitions() const;
    BlockForm form() const { return form_; }
    // Kernel rp_NAME of single_ray/NAME ("extend", "connect"), or rp_NAME_stream of stream/NAME if the blocks are in wide form
    // (where renders take all stages from one program instead).
    // more_definitions: " -D..." beside definitions().
    KernelName kernel_name(const Device& device, const std::string& name, uint32_t registers, const std::string& more_definitions = {}) const;
    // Launches such a kernel for a queue of up to `rays` rays; each work-item loops over its share of them.
    Status launch(Device& device, Queue& queue, const Kernel& kernel, uint64_t rays, Event* event) const;
    // Sets RP_GEOMETRY_PARAMETERS, the wide top tree if the blocks are wide, and block_count, then the rest.
    template <class... Rest>
    Status set(Kernel& kernel, const Rest&... rest) const {
        const bool wide = form_ == BlockForm::wide;
        if (has_objects_ && wide) return set_slabs(kernel, objects_, wide_top_, block_count_, rest...);
        if (has_objects_) return set_slabs(kernel, objects_, block_count_, rest...);
        if (wide) return set_slabs(kernel, wide_top_, block_count_, rest...);
        return set_slabs(kernel, block_count_, rest...);
    }

private:
    // Unused slabs repeat the first.
    template <class... Rest>
    Status set_slabs(Kernel& kernel, const Rest&... rest) const {
        const std::vector<Buffer>& slabs = *slabs_;
        const auto slab = [&](size_t i) -> const Buffer& { return slabs[i < slabs.size() ? i : 0]; };
        if (slabs.size() == 1) return kernel.set(top_grid_, top_nodes_, block_entries_, block_entry_paths_, *page_table_, demand_, slab(0), rest...);
        return kernel.set(top_grid_, top_nodes_, block_entries_, block_entry_paths_, *page_table_, demand_, slab(0), slab(1), slab(2), slab(3),
                          slab(4), slab(5), slab(6), slab(7), rest...);
    }

    GeometryBuffers() = default;
    BlockForm form_ = BlockForm::stored;
    rp_top_grid top_grid_ = {};
    Buffer wide_top_, top_nodes_, block_entries_, block_entry_paths_, demand_, objects_;
    bool has_objects_ = false;
    uint32_t stack_size_ = 0;
    const std::vector<Buffer>* slabs_ = nullptr;
    const Buffer* page_table_ = nullptr;
    uint32_t block_count_ = 0;
    std::string variants_;  // of definitions()
};

}  // namespace raypager
