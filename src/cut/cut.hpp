// Cuts all primitives of a scene into parts that become blocks.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "world/world.hpp"

namespace raypager {

struct Part {
    size_t begin, end;  // among refs, or in an order of primitives
};

// Where a set is cut in two.
class CutPlane {
public:
    // By the surface area heuristic (of many refs, on a sample of them), no side much lighter than the other; between the primitives in the middle,
    // where there is no such place. Reorders refs, of which there must be two.
    static CutPlane choose(std::span<PrimitiveRef> refs);
    // The same, where the bounds of twice the centres are known.
    static CutPlane choose(std::span<PrimitiveRef> refs, const Box4& centroids);
    // Both sides of the refs that it was chosen for get some. Any other ref belongs to a side too.
    bool is_left(const PrimitiveRef& ref) const { return is_left(ref.centroid(axis_), ref.id); }
    // centroid: along the axis, twice the centre.
    bool is_left(float centroid, uint32_t id) const {
        if (scale_ > 0) return (centroid - origin_) * scale_ < bin_;
        return centroid != origin_ ? centroid < origin_ : id < id_;
    }
    int axis() const { return axis_; }
    // Whether every ref with such a centroid along the axis belongs to the left, or to the right.
    bool is_left_of(float centroid) const { return scale_ > 0 ? (centroid - origin_) * scale_ < bin_ : centroid < origin_; }
    bool is_right_of(float centroid) const { return scale_ > 0 ? !is_left_of(centroid) : centroid > origin_; }

private:
    int axis_ = 0;
    float origin_ = 0, scale_ = 0, bin_ = 0;  // see BinMapping; with scale 0: origin is the centroid of the first primitive on the right
    uint32_t id_ = 0;                         // and this is its number
};

// Reorders refs and cuts them, by the surface area heuristic over whole primitives, into consecutive parts whose estimated bytes
// (PrimitiveRef::weight) are at most limit, or that are a single primitive. The parts come in depth-first order of the cut, so that
// neighbours in the list are neighbours in space.
std::vector<Part> cut(std::span<PrimitiveRef> refs, uint64_t limit);

// One step of it: the number of refs, at least two, that belong to the first half; they are moved to the front.
size_t cut_in_two(std::span<PrimitiveRef> refs);
// The same at a plane that is known; by all threads, and the result does not depend on how many there are.
size_t cut_in_two(std::span<PrimitiveRef> refs, const CutPlane& plane);

}  // namespace raypager
