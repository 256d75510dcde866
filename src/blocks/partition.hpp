// Which bucket a primitive goes to when a scene is too large for memory: the first cuts of the scene, found on a sample of it.
#pragma once

#include <cstdint>
#include <vector>

#include "blocks/cut.hpp"
#include "blocks/records.hpp"
#include "blocks/world.hpp"

namespace raypager {

class Partition {
public:
    // Cuts the sample (two refs at least) where cut() would, the heaviest part first, until no part weighs more than limit or there are
    // `most` of them. There will be two parts at least, and each gets some of the sample.
    Partition(std::vector<PrimitiveRef> sample, double limit, size_t most);
    // Parts are numbered in depth-first order of the cuts, so that neighbours in number are neighbours in space.
    uint32_t part_of(const PrimitiveRef& ref) const {
        uint32_t node = 0;
        while (nodes_[node].left) node = nodes_[node].left + !nodes_[node].plane.is_left(ref);
        return nodes_[node].part;
    }
    size_t parts() const { return parts_; }

private:
    struct Node {
        CutPlane plane;
        uint32_t left = 0;  // the right child follows it; 0: a leaf
        uint32_t part = 0;
    };
    void number(uint32_t node);
    std::vector<Node> nodes_;
    uint32_t parts_ = 0;
};

// count of a bucket's primitives, or all if there are fewer, spread evenly over its records: the same ones each time.
Result<std::vector<PrimitiveRef>> sample_bucket(const Bucket& bucket, uint64_t count);

}  // namespace raypager
