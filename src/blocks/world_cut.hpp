// Cuts all of a world into parts that become blocks.
#pragma once

#include <cstdint>
#include <vector>

#include "base/huge_pages.hpp"
#include "blocks/cut.hpp"
#include "blocks/world.hpp"

namespace raypager {

struct WorldParts {
    UnwrittenVector<uint32_t> order;  // of all primitives
    std::vector<Part> parts;          // of that order
};

// Primitives go first to where the cuts of a sample say, and each of these regions is then cut on its own (cut.hpp): so the refs of only as many
// regions as there are threads are in memory at a time. The result does not depend on the number of threads.
class WorldCut {
public:
    WorldCut(const World& world, const Weigher& weigher);
    // Estimated bytes of all primitives in blocks.
    uint64_t weight() const { return weight_; }
    // limit: of a part's bytes, as for cut().
    WorldParts run(uint64_t limit) &&;

private:
    PrimitiveRefs take_sample() const;
    // The order of primitives by region, in the order of the world within a region; and where the regions are.
    std::vector<Part> sort_into_regions(uint64_t limit, UnwrittenVector<uint32_t>& order);

    const World& world_;
    const Weigher& weigher_;
    PrimitiveRefs sample_;
    uint64_t weight_ = 0;
};

}  // namespace raypager
