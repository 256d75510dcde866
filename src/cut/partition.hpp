// Which region of a world a primitive goes to, or which bucket of a scene that is too large for memory: the first cuts, found on a sample.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "cut/cut.hpp"
#include "world/records.hpp"
#include "world/world.hpp"

namespace raypager {

class Partition {
public:
    // Cuts the sample (two refs at least) where cut() would, the heaviest part first, until no part weighs more than limit or there are
    // `most` of them. There will be two parts at least, and each gets some of the sample.
    Partition(PrimitiveRefs sample, double limit, size_t most);
    // Parts are numbered in depth-first order of the cuts, so that neighbours in number are neighbours in space.
    uint32_t part_of(const Box4& box, uint32_t id) const {
        const Float4 centroid = box.lower + box.upper;
        return descend(cells_[cell_of(centroid)], centroid, id);
    }
    uint32_t part_of(const PrimitiveRef& ref) const { return part_of(ref.box4(), ref.id); }
    // The same by the planes alone.
    uint32_t part_from_root(const Box4& box, uint32_t id) const { return descend(0, box.lower + box.upper, id); }
    size_t parts() const { return parts_; }

private:
    struct Node {
        CutPlane plane;
        uint32_t left = 0;  // the right child follows it; 0: a leaf
        uint32_t part = 0;
    };
    // Cells of a grid of centres, from begin to end along each axis.
    struct Cells {
        std::array<uint32_t, 3> begin, end;
    };

    void number(uint32_t node);
    void make_grid(const Box4& centroids, size_t samples);
    void enter(uint32_t node, const Cells& cells);
    void fill(uint32_t node, const Cells& cells);
    uint32_t descend(uint32_t node, Float4 centroid, uint32_t id) const {
        while (nodes_[node].left) {
            const CutPlane& plane = nodes_[node].plane;
            node = nodes_[node].left + !plane.is_left(centroid[plane.axis()], id);
        }
        return nodes_[node].part;
    }
    size_t cell_of(Float4 centroid) const {
        const Float4 place = greatest(least((centroid - origin_) * scale_, last_), Float4{});
        const auto cell = __builtin_convertvector(place, Int4);
        return (static_cast<size_t>(cell[2]) * count_[1] + static_cast<size_t>(cell[1])) * count_[0] + static_cast<size_t>(cell[0]);
    }

    std::vector<Node> nodes_;
    uint32_t parts_ = 0;
    // For each cell, the lowest node that all centres in it come through: from the root it would be a long way, of branches that are mispredicted.
    std::vector<uint16_t> cells_;
    Float4 origin_ = {}, scale_ = {}, last_ = {};  // of the cells
    std::array<uint32_t, 3> count_ = {1, 1, 1};    // of them along each axis
    std::array<std::vector<float>, 3> first_;      // the least centre in each of them; while the grid is made
};

// count of a bucket's primitives, or all if there are fewer, spread evenly over its records: the same ones each time.
Result<PrimitiveRefs> sample_bucket(const Bucket& bucket, uint64_t count);

}  // namespace raypager
