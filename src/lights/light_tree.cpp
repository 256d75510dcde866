#include "lights/light_tree.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "scene/vector.hpp"

namespace raypager {
namespace {

using std::numbers::pi;

constexpr size_t light_bins = 12;
// From here on ranges are halved, so that a way takes no more than 63 steps.
constexpr int deepest_by_cost = 31;
// What rounding an axis and a spread takes, in radians (abi/light_tree.h).
constexpr double rounding_of_angles = 0.004;
constexpr double rounding_of_radius = 1e-6;  // of the coordinates

// Directions within `spread` of the axis.
struct LightCone {
    Vector axis = {0, 0, 1};
    double spread = -1;  // radians; negative: none
};

// As in Conty Estevez and Kulla 2018.
LightCone around(const LightCone& a, const LightCone& b) {
    if (a.spread < b.spread) return around(b, a);
    if (b.spread < 0) return a;
    const double between = std::acos(std::clamp(dot(a.axis, b.axis), -1.0, 1.0));
    if (std::min(between + b.spread, pi) <= a.spread) return a;
    const double spread = (a.spread + between + b.spread) / 2;
    if (spread >= pi || length(cross(a.axis, b.axis)) < 1e-9) return {a.axis, pi};
    // The axis of a turns towards that of b.
    const Vector side = unit(b.axis - dot(a.axis, b.axis) * a.axis);
    const double turn = spread - a.spread;
    return {unit(std::cos(turn) * a.axis + std::sin(turn) * side), spread};
}

struct LightBox {
    Vector lower = {infinity, infinity, infinity}, upper = {-infinity, -infinity, -infinity};
    static constexpr double infinity = std::numeric_limits<double>::infinity();

    void grow(const Vector& p, double radius = 0) {
        for (size_t i = 0; i < 3; i++) {
            lower[i] = std::min(lower[i], p[i] - radius);
            upper[i] = std::max(upper[i], p[i] + radius);
        }
    }
    void grow(const LightBox& other) {
        for (size_t i = 0; i < 3; i++) {
            lower[i] = std::min(lower[i], other.lower[i]);
            upper[i] = std::max(upper[i], other.upper[i]);
        }
    }
    Vector middle() const { return 0.5 * (lower + upper); }
    // Half of the surface. padding: so much thicker.
    double area(double padding) const {
        const Vector e = upper - lower + Vector{padding, padding, padding};
        return e[0] * e[1] + e[1] * e[2] + e[2] * e[0];
    }
};

struct PlacedLight {
    LightBox extent;
    Vector middle;
    std::array<Vector, 3> points;  // the light lies within `radius` of these and of what is between them
    size_t point_count = 1;
    double radius = 0, strength = 0;
    LightCone cone;
    uint32_t light = 0;
};

PlacedLight item_of(const rp_light& light, uint32_t number, double strength) {
    PlacedLight item;
    item.light = number;
    item.strength = strength;
    const auto vector = [](const float(&v)[3]) { return Vector{v[0], v[1], v[2]}; };
    const Vector p = vector(light.p);
    item.points[0] = p;
    item.cone.spread = pi;
    if (light.kind == RP_LIGHT_SPHERE) item.radius = std::abs(light.e1[0]);
    if (light.kind == RP_LIGHT_TRIANGLE) {
        const Vector e1 = vector(light.e1), e2 = vector(light.e2), normal = cross(e1, e2);
        item.points = {p, p + e1, p + e2};
        item.point_count = 3;
        const double size = length(normal);
        if (!(light.flags & RP_LIGHT_TWO_SIDED) && size > 0) item.cone = {(1 / size) * normal, 0};
    }
    for (size_t i = 0; i < item.point_count; i++) item.extent.grow(item.points[i], item.radius);
    item.middle = item.extent.middle();
    return item;
}

uint32_t coded_axis(const Vector& axis) {
    uint32_t code = 0;
    for (size_t i = 0; i < 3; i++) code |= (static_cast<uint32_t>(std::lround(axis[i] * 511)) & 1023u) << 10 * i;
    return code;
}

uint32_t coded_spread(double spread) {
    const double angle = std::min(pi, spread + rounding_of_angles);
    const auto cosine = static_cast<int32_t>(std::lround(std::cos(angle) * 32767)), sine = static_cast<int32_t>(std::lround(std::sin(angle) * 65535));
    return (static_cast<uint32_t>(cosine) & 0xffffu) | static_cast<uint32_t>(sine) << 16;
}

// Lights that a split would put together.
struct LightBin {
    LightBox extent;
    Vector axes = {0, 0, 0};  // sum, by strength
    double strength = 0;
    size_t count = 0;

    void add(const PlacedLight& item) {
        extent.grow(item.extent);
        if (item.cone.spread < pi) axes = axes + item.strength * item.cone.axis;
        strength += item.strength;
        count++;
    }
    void add(const LightBin& other) {
        extent.grow(other.extent);
        axes = axes + other.axes;
        strength += other.strength;
        count += other.count;
    }
    // Strength, times the size of the place, times how many directions it shines to. Axes that agree add up to a long sum; where they don't, or there
    // are none, four times as many directions are lit as by one.
    double cost(double padding) const { return strength > 0 ? strength * extent.area(padding) * (4 - 3 * length(axes) / strength) : 0; }
};

class LightTreeBuilder {
public:
    LightTreeBuilder(std::span<const rp_light> lights, std::span<const uint32_t> placed) {
        double all = 0;
        for (const uint32_t i : placed) all += light_strength(lights[i]);
        for (const uint32_t i : placed) items_.push_back(item_of(lights[i], i, light_strength(lights[i]) / all));
        tree_.ways.resize(lights.size());
        tree_.nodes.resize(2 * (items_.size() - 1));
    }

    LightTree build() {
        build_pair(0, items_.size(), 0, 0);
        return std::move(tree_);
    }

private:
    // Of items from `first` on; way: to here, so many steps. Returns the pair's number and all axes.
    std::pair<uint32_t, LightCone> build_pair(size_t first, size_t count, uint64_t way, int depth) {
        const uint32_t pair = next_pair_++;
        const size_t middle = split(first, count, depth);
        const LightCone left = build_node(2 * size_t{pair}, first, middle - first, way, depth + 1);
        const LightCone right = build_node(2 * size_t{pair} + 1, middle, first + count - middle, way | uint64_t{1} << depth, depth + 1);
        return {pair, around(left, right)};
    }

    LightCone build_node(size_t number, size_t first, size_t count, uint64_t way, int depth) {
        const auto items = std::span(items_).subspan(first, count);
        LightBox extent;
        double strength = 0, radius = 0, largest = 0;
        for (const PlacedLight& item : items) extent.grow(item.extent), strength += item.strength;
        const Float3 center = float3(extent.middle());
        for (const PlacedLight& item : items)
            for (size_t i = 0; i < item.point_count; i++) radius = std::max(radius, length(item.points[i] - vector(center)) + item.radius);
        for (size_t i = 0; i < 3; i++) largest = std::max({largest, std::abs(extent.lower[i]), std::abs(extent.upper[i])});
        LightCone cone;
        uint32_t next;
        if (count == 1) {
            cone = items[0].cone;
            next = RP_LIGHT_LEAF | items[0].light;
            tree_.ways[items[0].light] = way | uint64_t{1} << depth;
        } else {
            std::tie(next, cone) = build_pair(first, count, way, depth);
        }
        // A point stays one: there is nothing to round.
        const double slack = radius > 0 ? rounding_of_radius * (largest + radius) : 0;
        tree_.nodes[number] = {{center.x, center.y, center.z}, static_cast<float>(radius + slack), static_cast<float>(strength),
                               coded_axis(cone.axis),          coded_spread(cone.spread),          next};
        return cone;
    }

    // Puts the items in the order of the cheapest of some splits, and returns where the second part begins.
    size_t split(size_t first, size_t count, int depth) {
        const auto items = std::span(items_).subspan(first, count);
        LightBox middles;
        for (const PlacedLight& item : items) middles.grow(item.middle);
        const Vector size = middles.upper - middles.lower;
        const double longest_size = *std::max_element(size.begin(), size.end());
        const double padding = longest_size / (4 * light_bins);  // rows and points take room, too
        std::array<std::array<LightBin, light_bins>, 3> bins;
        if (depth < deepest_by_cost && longest_size > 0)
            for (const PlacedLight& item : items)
                for (size_t axis = 0; axis < 3; axis++)
                    if (size[axis] > 0) bins[axis][bin_of(item, middles, axis)].add(item);
        double best = std::numeric_limits<double>::infinity();
        size_t best_axis = 3, best_bin = 0;
        for (size_t axis = 0; axis < 3; axis++) {
            std::array<double, light_bins> above = {};
            LightBin sum;
            for (size_t b = light_bins; b-- > 1;) {
                sum.add(bins[axis][b]);
                above[b] = sum.cost(padding);
            }
            sum = {};
            for (size_t b = 1; b < light_bins; b++) {
                sum.add(bins[axis][b - 1]);
                if (sum.count == 0 || sum.count == count) continue;
                // Thin parts are no better than thick ones: their sides are what the place is long.
                const double cost = (sum.cost(padding) + above[b]) * longest_size / size[axis];
                if (cost < best) best = cost, best_axis = axis, best_bin = b;
            }
        }
        if (best_axis < 3) {
            const auto second =
                std::partition(items.begin(), items.end(), [&](const PlacedLight& i) { return bin_of(i, middles, best_axis) < best_bin; });
            return first + static_cast<size_t>(second - items.begin());
        }
        const size_t longest = static_cast<size_t>(std::max_element(size.begin(), size.end()) - size.begin());
        std::nth_element(items.begin(), items.begin() + static_cast<ptrdiff_t>(count / 2), items.end(),
                         [&](const PlacedLight& a, const PlacedLight& b) {
                             return a.middle[longest] != b.middle[longest] ? a.middle[longest] < b.middle[longest] : a.light < b.light;
                         });
        return first + count / 2;
    }

    static size_t bin_of(const PlacedLight& item, const LightBox& middles, size_t axis) {
        const double place = (item.middle[axis] - middles.lower[axis]) / (middles.upper[axis] - middles.lower[axis]);
        return std::min(light_bins - 1, static_cast<size_t>(place * light_bins));
    }

    std::vector<PlacedLight> items_;
    LightTree tree_;
    uint32_t next_pair_ = 0;
};

}  // namespace

double light_strength(const rp_light& light) {
    const double y = std::max(0.0, 0.2126 * light.radiance[0] + 0.7152 * light.radiance[1] + 0.0722 * light.radiance[2]);
    switch (light.kind) {
        case RP_LIGHT_TRIANGLE:
            return y * std::max(0.0f, light.area);
        case RP_LIGHT_SPHERE:
            return y * std::max(0.0f, light.area) / 4;  // of a disk as large
        default:
            return y;
    }
}

LightTree build_light_tree(std::span<const rp_light> lights, std::span<const uint32_t> placed) { return LightTreeBuilder(lights, placed).build(); }

}  // namespace raypager
