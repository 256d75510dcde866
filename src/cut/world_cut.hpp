// Cuts all of a world into parts that become blocks.
#pragma once

#include <cstdint>
#include <vector>

#include "base/huge_pages.hpp"
#include "cut/cut.hpp"
#include "world/world.hpp"

namespace raypager {

struct WorldParts {
    UnwrittenVector<uint32_t> order;  // of all primitives
    std::vector<Part> parts;          // of that order
};

// The primitives of all but small worlds go first to where the cuts of a sample say, and each of these regions is then cut on its own (cut.hpp): so
// only the refs of the regions at hand are in memory. The result does not depend on the number of threads.
class WorldCut {
public:
    WorldCut(const World& world, const Weigher& weigher);
    // Estimated bytes of all primitives in blocks.
    uint64_t weight() const { return weight_; }
    // limit: of a part's bytes, as for cut(). memory: for refs of the regions at hand; there is one at least.
    WorldParts run(uint64_t limit, uint64_t memory = UINT64_MAX) &&;

private:
    PrimitiveRefs take_sample() const;
    // The order of primitives by region, in the order of the world within a region; and where the regions are.
    std::vector<Part> sort_into_regions(uint64_t limit, UnwrittenVector<uint32_t>& order);
    // order: of the refs, in that of the world, where they begin at `begin`.
    std::vector<Part> cut_region(std::span<PrimitiveRef> refs, uint64_t limit, std::span<uint32_t> order, size_t begin) const;

    const World& world_;
    const Weigher& weigher_;
    PrimitiveRefs sample_;
    uint64_t weight_ = 0;
};

}  // namespace raypager
