#include "cut/strip_cover.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <limits>

#include "base/check.hpp"
#include "cut/costs.hpp"

namespace raypager {
namespace {

using Mask = uint64_t;  // a set of triangles
static_assert(most_covered <= 64);

constexpr Mask bit(uint32_t triangle) { return Mask{1} << triangle; }

// Triangles that share an edge and agree on which side is outside, at most one across each edge. Then every simple path from
// neighbour to neighbour is a strip: it leaves a triangle by another edge than it came in by.
class Neighbours {
public:
    explicit Neighbours(std::span<const Triangle> triangles) {
        for (uint32_t t = 0; t < triangles.size(); t++)
            for (int i = 0; i < 3; i++) meet(triangles[t][i], triangles[t][(i + 1) % 3], t);
    }

    Mask of(uint32_t triangle) const { return masks_[triangle]; }

private:
    static constexpr size_t slots = 512;  // more than twice the edges that there can be
    static constexpr size_t max_edges = 3 * most_covered;
    static_assert(max_edges < 255);

    // Half-edges of one direction that have met none of the other yet, in a queue: where many triangles share an edge, the first ones of both
    // directions become neighbours, then the second ones, and so on.
    struct Edge {
        uint64_t vertices;
        bool upwards;
        uint8_t first, last;  // of the queue: half-edges; none: it is empty
    };
    static constexpr uint8_t none = 255;

    void meet(uint32_t from, uint32_t to, uint32_t triangle) {
        Edge& edge = find(uint64_t{std::min(from, to)} << 32 | std::max(from, to));
        const bool upwards = from < to;
        if (edge.first != none && edge.upwards != upwards) {
            join(triangles_[edge.first], triangle);
            edge.first = edge.first == edge.last ? none : next_[edge.first];
            return;
        }
        const uint8_t half = half_edges_++;
        triangles_[half] = static_cast<uint8_t>(triangle);
        if (edge.first == none)
            edge.first = half;
        else
            next_[edge.last] = half;
        edge.last = half;
        edge.upwards = upwards;
    }

    Edge& find(uint64_t vertices) {
        size_t slot = vertices * 0x9e3779b97f4a7c15u >> 55;
        static_assert(slots == size_t{1} << (64 - 55));
        for (; table_[slot] != 0; slot = (slot + 1) % slots)
            if (edges_[table_[slot] - 1].vertices == vertices) return edges_[table_[slot] - 1];
        edges_[edge_count_] = {vertices, false, none, none};
        table_[slot] = static_cast<uint8_t>(++edge_count_);
        return edges_[edge_count_ - 1];
    }

    void join(uint32_t a, uint32_t b) {
        if (a == b) return;
        masks_[a] |= bit(b);
        masks_[b] |= bit(a);
    }

    std::array<Mask, most_covered> masks_ = {};
    std::array<uint8_t, slots> table_ = {};  // edges, counted from 1
    std::array<Edge, max_edges> edges_;
    std::array<uint8_t, max_edges> triangles_, next_;  // of half-edges
    uint8_t edge_count_ = 0, half_edges_ = 0;
};

struct Path {
    Box4 box;
    Mask mask = 0, around = 0;  // its triangles, and their neighbours
    std::array<uint8_t, RP_LEAF_MAX_PRIMITIVES> triangles = {};
    uint32_t count = 0;

    Path reversed() const {
        Path path = *this;
        std::reverse(path.triangles.begin(), path.triangles.begin() + count);
        return path;
    }
    uint32_t last() const { return triangles[count - 1]; }
};

class Cover {
public:
    Cover(std::span<const Triangle> triangles, std::span<const Box4> boxes) : triangles_(triangles), boxes_(boxes), neighbours_(triangles) {
        free_ = triangles.size() == 64 ? ~Mask{0} : bit(static_cast<uint32_t>(triangles.size())) - 1;
        for (uint32_t t = 0; t < triangles.size(); t++) {
            mean_area_ += boxes[t].rough_half_area() / static_cast<float>(boxes.size());
            for (Mask rest = neighbours_.of(t); rest != 0; rest &= rest - 1) degree_[t]++;
            by_degree_[degree_[t]] |= bit(t);
        }
    }

    std::vector<Strip> run() {
        std::vector<Strip> strips;
        strips.reserve(triangles_.size() / 2);
        while (free_ != 0) {
            best_cost_ = std::numeric_limits<float>::infinity();
            extend(longer(Path(), hardest()), true);
            for (uint32_t i = 0; i < best_.count; i++) take(best_.triangles[i]);
            std::array<uint32_t, RP_LEAF_MAX_PRIMITIVES> order;
            std::copy_n(best_.triangles.begin(), best_.count, order.begin());
            strips.push_back(make_strip(triangles_, std::span(order).first(best_.count)));
        }
        return strips;
    }

private:
    // The triangle with the fewest free neighbours: it has the fewest chances left.
    uint32_t hardest() const {
        size_t degree = 0;
        while (by_degree_[degree] == 0) degree++;
        return static_cast<uint32_t>(std::countr_zero(by_degree_[degree]));
    }

    // The triangle is free no more.
    void take(uint32_t triangle) {
        free_ &= ~bit(triangle);
        by_degree_[degree_[triangle]] &= ~bit(triangle);
        for (Mask rest = neighbours_.of(triangle) & free_; rest != 0; rest &= rest - 1) {
            const auto neighbour = static_cast<uint32_t>(std::countr_zero(rest));
            by_degree_[degree_[neighbour]--] &= ~bit(neighbour);
            by_degree_[degree_[neighbour]] |= bit(neighbour);
        }
    }

    Path longer(const Path& path, uint32_t triangle) const {
        Path result = path;
        result.triangles[result.count++] = static_cast<uint8_t>(triangle);
        result.box.grow(boxes_[triangle]);
        result.mask |= bit(triangle);
        result.around |= neighbours_.of(triangle);
        return result;
    }

    // Tries all paths that extend this one at its end, and at its beginning too if both_ends.
    void extend(const Path& path, bool both_ends) {
        const float area = path.box.rough_half_area();
        consider(path, area);
        // Boxes only grow, and a full strip shares what a leaf costs among the most triangles.
        if (path.count == RP_LEAF_MAX_PRIMITIVES || share(area, RP_LEAF_MAX_PRIMITIVES, leaf_overhead) >= best_cost_) return;
        if (both_ends) extend_at_end(path.reversed(), false);
        extend_at_end(path, both_ends);
    }

    void extend_at_end(const Path& path, bool both_ends) {
        for (Mask rest = neighbours_.of(path.last()) & free_ & ~path.mask; rest != 0; rest &= rest - 1)
            extend(longer(path, static_cast<uint32_t>(std::countr_zero(rest))), both_ends);
    }

    // A triangle's share of the cost of a strip. overhead: in mean areas.
    float share(float area, uint32_t count, float overhead) const {
        static_assert(RP_LEAF_MAX_PRIMITIVES == 4);
        constexpr float nth[] = {0, 1, 1.0f / 2, 1.0f / 3, 1.0f / 4};
        return (area * (node_cost + leaf_cost) + mean_area_ * overhead) * nth[count] + area * primitive_cost;
    }

    void consider(const Path& path, float area) {
        // Stranded triangles only add to the cost, and take long to count.
        if (share(area, path.count, leaf_overhead) >= best_cost_) return;
        const float cost = share(area, path.count, leaf_overhead + stranded_cost * static_cast<float>(stranded(path)));
        if (cost >= best_cost_) return;
        best_cost_ = cost;
        best_ = path;
    }

    // How many triangles would be left without a free neighbour.
    int stranded(const Path& path) const {
        const Mask left = free_ & ~path.mask;
        int count = 0;
        for (Mask rest = path.around & left; rest != 0; rest &= rest - 1)
            count += (neighbours_.of(static_cast<uint32_t>(std::countr_zero(rest))) & left) == 0;
        return count;
    }

    std::span<const Triangle> triangles_;
    std::span<const Box4> boxes_;
    Neighbours neighbours_;
    float mean_area_ = 0;
    Mask free_;
    std::array<uint8_t, most_covered> degree_ = {};  // free neighbours: three at most, one across each edge
    std::array<Mask, 4> by_degree_ = {};             // free triangles that have so many
    float best_cost_ = 0;
    Path best_;
};

}  // namespace

std::vector<Strip> cover_with_strips(std::span<const Triangle> triangles, std::span<const Box4> boxes) {
    RAYPAGER_CHECK(!triangles.empty() && triangles.size() <= most_covered && triangles.size() == boxes.size());
    return Cover(triangles, boxes).run();
}

}  // namespace raypager
