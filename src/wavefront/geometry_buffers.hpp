// What kernels need to walk through a scene, beside the blocks themselves: the top tree and the demand counters on the device, and the
// argument list of kernels/lib/geometry.cl.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "device/device.hpp"
#include "raypager/abi/block.h"
#include "raypager/abi/path.h"
#include "raypager/status.hpp"
#include "store/block_file.hpp"

namespace raypager {

class GeometryBuffers {
public:
    static uint64_t bytes(const BakedScene& scene);
    // slabs and page_table outlive this.
    static Result<GeometryBuffers> create(Device& device, const BakedScene& scene, const std::vector<Buffer>& slabs, const Buffer& page_table);

    const Buffer& portals() const { return portals_; }
    const Buffer& pages() const { return *page_table_; }
    const Buffer& demand() const { return demand_; }  // arrays of abi/path.h
    uint32_t block_count() const { return block_count_; }
    // "-DNAME=VALUE ..." that kernels with RP_GEOMETRY_PARAMETERS are built with.
    std::string definitions() const;
    // Sets RP_GEOMETRY_PARAMETERS and block_count, then the rest. Unused slabs repeat the first.
    template <class... Rest>
    Status set(Kernel& kernel, const Rest&... rest) const {
        const std::vector<Buffer>& slabs = *slabs_;
        const auto slab = [&](size_t i) -> const Buffer& { return slabs[i < slabs.size() ? i : 0]; };
        if (slabs.size() == 1)
            return kernel.set(top_grid_, top_nodes_, portals_, portal_paths_, *page_table_, demand_, slab(0), block_count_, rest...);
        return kernel.set(top_grid_, top_nodes_, portals_, portal_paths_, *page_table_, demand_, slab(0), slab(1), slab(2), slab(3), slab(4), slab(5),
                          slab(6), slab(7), block_count_, rest...);
    }

private:
    GeometryBuffers() = default;
    Buffer top_grid_, top_nodes_, portals_, portal_paths_, demand_;
    const std::vector<Buffer>* slabs_ = nullptr;
    const Buffer* page_table_ = nullptr;
    uint32_t block_count_ = 0;
    std::string traversal_options_;
};

}  // namespace raypager
