#include "procedural/island_plan.hpp"

#include <algorithm>
#include <cmath>

#include "procedural/island_plants.hpp"
#include "procedural/plants.hpp"

namespace raypager {
namespace {

constexpr double radius_a_tree = 3.0;  // times the square root of how many there are: the island's radius
constexpr double smallest_radius = 60;
constexpr double finest_land = 0.5;  // on average from one vertex to the next
constexpr double most_quads = 5600;  // along a side: heights are in memory

// Shares in a thousand of all instances and of all triangles, and how many triangles (all told) make another kind worth while.
struct Share {
    IslandThing thing;
    std::string_view name;
    uint64_t instances, triangles, all_a_kind, most_kinds, least_triangles;
};
constexpr Share shares[] = {
    {IslandThing::pebble, "pebble", 150, 20, 40'000, 12, 36},
    {IslandThing::boulder, "boulder", 15, 25, 30'000, 10, 36},
    {IslandThing::shell, "shell", 45, 15, 40'000, 8, 24},
    {IslandThing::coral, "coral", 25, 12, 40'000, 8, 27},
    {IslandThing::driftwood, "driftwood", 3, 10, 40'000, 6, 27},
    {IslandThing::litter, "litter", 110, 0, 10'000, 6, fallen_leaf_triangles},
    {IslandThing::tuft, "tuft", 0, 30, 10'000, 8, 12},  // as many instances as the others leave
    {IslandThing::rosette, "rosette", 40, 50, 25'000, 24, 24},
    {IslandThing::fern, "fern", 90, 40, 25'000, 24, 24},
    {IslandThing::hedge, "hedge", 50, 80, 25'000, 24, min_hedge_triangles},
    {IslandThing::palm, "palm", 35, 220, 20'000, 48, min_palm_triangles},
    {IslandThing::tree, "tree", 85, 0, 15'000, 64, min_tree_triangles},
};
static_assert(std::size(shares) == island_things);

uint64_t quads_along(double triangles, double side) {
    return static_cast<uint64_t>(std::max(6.0, std::min({std::sqrt(triangles / 2), side / finest_land, most_quads})));
}

}  // namespace

IslandPlan::IslandPlan(const MakeSceneOptions& options) {
    uint64_t placed = 0;
    for (const Share& share : shares) {
        IslandKind& kind = things[static_cast<size_t>(share.thing)];
        kind.name = share.name;
        kind.kinds = std::clamp<uint64_t>(options.triangles / share.all_a_kind, 1, share.most_kinds);
        kind.triangles =
            share.thing == IslandThing::tree ? 0 : std::max(options.triangles / 1000 * share.triangles / kind.kinds, share.least_triangles);
        if (share.thing == IslandThing::litter) kind.triangles = share.least_triangles;
        kind.instances = options.instances / 1000 * share.instances + options.instances % 1000 * share.instances / 1000;
        placed += kind.instances;
    }
    things[static_cast<size_t>(IslandThing::tuft)].instances += options.instances - placed;
    radius = std::max(smallest_radius, radius_a_tree * std::sqrt(static_cast<double>((*this)[IslandThing::tree].instances)));
    const auto all = static_cast<double>(options.triangles);
    ground_quads = quads_along(0.15 * all, 2.5 * radius);
    water_quads = quads_along(0.10 * all, 2.5 * radius);
    sea_quads = std::clamp<uint64_t>(options.triangles / 200'000, 4, 32) * 2;
    for (image_size = 128; image_size < 2048 && static_cast<double>(uint64_t{image_size} * image_size) < 0.15 * all;) image_size *= 2;
}

std::vector<IslandPlace> archipelago(uint64_t copies, double least_distance, uint64_t seed) {
    constexpr double height_of_row = 0.8660254037844386, disturbance = 0.08;  // in distances of neighbours
    struct Site {
        double x, z;
        uint64_t number;
    };
    const auto reach = static_cast<int64_t>(std::ceil(2 * std::sqrt(static_cast<double>(copies)))) + 2;
    std::vector<Site> sites;
    for (int64_t row = 0; row <= reach; row++)
        for (int64_t column = -reach; column <= reach; column++) {
            const double x = static_cast<double>(column) + (row % 2 != 0 ? 0.5 : 0.0), z = -height_of_row * static_cast<double>(row);
            sites.push_back({x, z, sites.size()});
        }
    std::ranges::sort(sites, [](const Site& a, const Site& b) {
        const double near_a = a.x * a.x + a.z * a.z, near_b = b.x * b.x + b.z * b.z;
        return near_a != near_b ? near_a < near_b : a.number < b.number;
    });
    const double step = least_distance / (1 - 2 * disturbance);
    std::vector<IslandPlace> places = {{0, 0, {0, 1}}};
    for (uint64_t i = 1; i < copies; i++) {
        Random random(seed, 0x69736c65 + i);
        const SinCos aside = sincos_turns(random.uniform());
        const double off = disturbance * random.uniform();
        places.push_back({(sites[i].x + off * aside.cos) * step, (sites[i].z + off * aside.sin) * step, sincos_turns(random.uniform())});
    }
    return places;
}

}  // namespace raypager
