#include "blocks/strip_cover.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <limits>

#include "base/check.hpp"
#include "blocks/costs.hpp"

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
        std::array<HalfEdge, 3 * most_covered> edges;
        size_t count = 0;
        for (uint32_t t = 0; t < triangles.size(); t++) {
            for (int i = 0; i < 3; i++) {
                const uint32_t from = triangles[t][i], to = triangles[t][(i + 1) % 3];
                edges[count++] = {uint64_t{std::min(from, to)} << 32 | std::max(from, to), from < to, t};
            }
        }
        std::sort(edges.begin(), edges.begin() + count);
        for (size_t begin = 0, end; begin < count; begin = end) {
            end = begin + 1;
            while (end < count && edges[end].vertices == edges[begin].vertices) end++;
            // Those that run downwards come first; pair them with those that run upwards.
            size_t up = begin;
            while (up < end && !edges[up].upwards) up++;
            for (size_t down = begin, first_up = up; down < first_up && up < end; down++, up++) join(edges[down].triangle, edges[up].triangle);
        }
    }

    Mask of(uint32_t triangle) const { return masks_[triangle]; }

private:
    struct HalfEdge {
        uint64_t vertices;
        bool upwards;
        uint32_t triangle;
        auto operator<=>(const HalfEdge&) const = default;
    };

    void join(uint32_t a, uint32_t b) {
        if (a == b) return;
        masks_[a] |= bit(b);
        masks_[b] |= bit(a);
    }

    std::array<Mask, most_covered> masks_ = {};
};

struct Path {
    uint32_t count = 0;
    std::array<uint32_t, RP_LEAF_MAX_PRIMITIVES> triangles = {};
    Box box;
    Mask mask = 0;

    Path with(uint32_t triangle, const Box& triangle_box) const {
        Path longer = *this;
        longer.triangles[longer.count++] = triangle;
        longer.box.grow(triangle_box);
        longer.mask |= bit(triangle);
        return longer;
    }
    Path reversed() const {
        Path path = *this;
        std::reverse(path.triangles.begin(), path.triangles.begin() + count);
        return path;
    }
    uint32_t last() const { return triangles[count - 1]; }
};

class Cover {
public:
    Cover(std::span<const Triangle> triangles, std::span<const Box> boxes) : triangles_(triangles), boxes_(boxes), neighbours_(triangles) {
        for (const Box& box : boxes) mean_area_ += box.half_area() / static_cast<double>(boxes.size());
        free_ = triangles.size() == 64 ? ~Mask{0} : bit(static_cast<uint32_t>(triangles.size())) - 1;
    }

    std::vector<Strip> run() {
        std::vector<Strip> strips;
        while (free_ != 0) {
            best_cost_ = std::numeric_limits<double>::infinity();
            const uint32_t start = hardest();
            extend(Path().with(start, boxes_[start]), true);
            free_ &= ~best_.mask;
            strips.push_back(make_strip(triangles_, std::span(best_.triangles).first(best_.count)));
        }
        return strips;
    }

private:
    // The triangle with the fewest free neighbours: it has the fewest chances left.
    uint32_t hardest() const {
        uint32_t best = 0;
        int fewest = std::numeric_limits<int>::max();
        for (Mask rest = free_; rest != 0; rest &= rest - 1) {
            const auto triangle = static_cast<uint32_t>(std::countr_zero(rest));
            const int count = std::popcount(neighbours_.of(triangle) & free_);
            if (count >= fewest) continue;
            best = triangle;
            fewest = count;
        }
        return best;
    }

    // Tries all paths that extend this one at its end, and at its beginning too if both_ends.
    void extend(const Path& path, bool both_ends) {
        consider(path);
        if (path.count == RP_LEAF_MAX_PRIMITIVES) return;
        if (both_ends) extend_at_end(path.reversed(), false);
        extend_at_end(path, both_ends);
    }

    void extend_at_end(const Path& path, bool both_ends) {
        for (Mask rest = neighbours_.of(path.last()) & free_ & ~path.mask; rest != 0; rest &= rest - 1) {
            const auto next = static_cast<uint32_t>(std::countr_zero(rest));
            extend(path.with(next, boxes_[next]), both_ends);
        }
    }

    void consider(const Path& path) {
        const double n = path.count;
        const double cost =
            (path.box.half_area() * (node_cost + leaf_cost + primitive_cost * n) + mean_area_ * (leaf_overhead + stranded_cost * stranded(path))) / n;
        if (cost >= best_cost_) return;
        best_cost_ = cost;
        best_ = path;
    }

    // How many triangles would be left without a free neighbour.
    int stranded(const Path& path) const {
        const Mask left = free_ & ~path.mask;
        Mask around = 0;
        for (uint32_t i = 0; i < path.count; i++) around |= neighbours_.of(path.triangles[i]);
        int count = 0;
        for (Mask rest = around & left; rest != 0; rest &= rest - 1)
            count += (neighbours_.of(static_cast<uint32_t>(std::countr_zero(rest))) & left) == 0;
        return count;
    }

    std::span<const Triangle> triangles_;
    std::span<const Box> boxes_;
    Neighbours neighbours_;
    double mean_area_ = 0;
    Mask free_;
    double best_cost_ = 0;
    Path best_;
};

}  // namespace

std::vector<Strip> cover_with_strips(std::span<const Triangle> triangles, std::span<const Box> boxes) {
    RAYPAGER_CHECK(!triangles.empty() && triangles.size() <= most_covered && triangles.size() == boxes.size());
    return Cover(triangles, boxes).run();
}

}  // namespace raypager
