#include "procedural/plants.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <vector>

#include "base/check.hpp"
#include "procedural/limbs.hpp"
#include "procedural/noise.hpp"
#include "procedural/parts.hpp"

namespace raypager {
namespace {

constexpr double golden_turn = 0.381966011250105;  // leaves the largest gaps between branches that follow each other

uint64_t limb_triangles(uint64_t sides, uint64_t steps) { return sides * (2 * steps - 1); }

// How finely a limb of about so many triangles is made.
struct LimbGrid {
    uint32_t sides = 3;
    size_t steps = 2;
    LimbGrid(uint64_t triangles, uint32_t most_sides, double slenderness) {
        sides = static_cast<uint32_t>(std::clamp(std::sqrt(static_cast<double>(triangles) / slenderness), 3.0, static_cast<double>(most_sides)));
        steps = std::max<size_t>(2, (triangles / sides + 1) / 2);
    }
};

class TreeGrower {
public:
    TreeGrower(TreeHabit habit, uint64_t triangles, Random& random)
        : conifer_(habit == TreeHabit::conifer),
          triangles_(triangles),
          height_(conifer_ ? random.uniform(13, 24) : random.uniform(8, 16)),
          crown_base_(conifer_ ? random.uniform(0.08, 0.2) : random.uniform(0.2, 0.38)),
          crown_radius_(height_ * (conifer_ ? random.uniform(0.15, 0.22) : random.uniform(0.3, 0.42))),
          random_(random) {}

    Tree grow() {
        const uint64_t wood = triangles_ * 3 / 10, of_trunk = std::max<uint64_t>(wood / 5, 12);
        const LimbGrid trunk_grid(of_trunk, 20, 8);
        // Its roots are in the ground, also on slopes.
        trunk_ = grow_limb({0, -0.5, 0}, upwards, height_ + 0.5, height_ * random_.uniform(0.016, 0.024), 0.3, trunk_grid.steps, random_);
        add_limb(tree_.wood, trunk_, trunk_grid.sides);
        const uint64_t left = wood - std::min(wood, tree_.wood.triangles.size());
        const uint64_t limbs = std::clamp<uint64_t>(left / 15, 1, 160);
        const LimbGrid grid(std::max<uint64_t>(left / limbs, limb_triangles(3, 2)), 8, 5);
        add_branches(limbs, grid);
        for (const Limb& limb : limbs_) add_limb(tree_.wood, limb, grid.sides);
        add_leaves((triangles_ - std::min(triangles_, tree_.wood.triangles.size())) / 2);
        return std::move(tree_);
    }

private:
    // Of the crown, at a share of its height, in shares of its radius.
    double width(double share) const {
        if (conifer_) return 1.04 - share;
        const double off = (share - 0.4) / 0.62;
        return std::sqrt(std::max(0.0, 1 - off * off));
    }

    void add_branches(uint64_t count, const LimbGrid& grid) {
        const uint64_t primary = count < 8 ? count : conifer_ ? count / 2 : std::max<uint64_t>(count / 4, 5);
        for (uint64_t i = 0; i < primary; i++) {
            const double share = (static_cast<double>(i) + random_.uniform(0.2, 0.8)) / static_cast<double>(primary);
            const double on_trunk = crown_base_ + (1 - crown_base_) * share * (conifer_ ? 0.97 : 0.85);
            const Vector out = heading(golden_turn * static_cast<double>(i) + random_.uniform(0, 0.1));
            const double lift = conifer_ ? -0.15 + 0.5 * share : 0.35 + 0.7 * share;
            limbs_.push_back(grow_limb(trunk_.at(on_trunk), unit(out + upwards * lift), crown_radius_ * width(share) * random_.uniform(0.85, 1.1),
                                       trunk_.radius * (conifer_ ? 0.28 : 0.5) * (1 - 0.7 * share), conifer_ ? -0.25 : 0.3, grid.steps, random_));
        }
        for (uint64_t i = primary; i < count; i++) {
            const Limb& parent = limbs_[random_.below(static_cast<uint32_t>(primary))];
            const double share = random_.uniform(0.3, 0.9);
            const Vector along = parent.direction(share);
            const Vector side = unit(cross(along, upwards)) * (random_.below(2) == 0 ? 1 : -1);
            const Vector direction = conifer_ ? unit(along * 0.7 + side) : unit(along * 0.6 + random_.direction() * 0.8 + upwards * 0.2);
            const double length = parent.length * 0.55 * (1.15 - share);
            limbs_.push_back(
                grow_limb(parent.at(share), direction, length, parent.radius * 0.5 * (1 - 0.6 * share), conifer_ ? -0.2 : 0.2, grid.steps, random_));
        }
    }

    // Clusters along the outer parts of the branches. However many leaves there are, they cover the same area.
    void add_leaves(uint64_t count) {
        if (count == 0) return;
        std::vector<double> ends;  // of the limbs, laid end to end
        double sum = 0;
        for (const Limb& limb : limbs_) ends.push_back(sum += limb.length);
        const double slender = conifer_ ? 0.3 : 0.6, covered = (conifer_ ? 4.2 : 6.5) * crown_radius_ * (conifer_ ? 0.5 * height_ : crown_radius_);
        const double length = std::sqrt(2 * covered / (static_cast<double>(count) * slender));
        const double spread = height_ * (conifer_ ? 0.018 : 0.05);
        for (uint64_t i = 0; i < count; i++) {
            const double place = random_.uniform(0, sum);
            const size_t number = static_cast<size_t>(std::ranges::lower_bound(ends, place) - ends.begin());
            const Limb& limb = limbs_[std::min(number, limbs_.size() - 1)];
            constexpr uint32_t clusters = 5;
            const uint32_t cluster = conifer_ ? 0 : random_.below(clusters);
            const double share = conifer_ ? random_.uniform(0.1, 1) : (cluster + random_.uniform(0.6, 1)) / clusters;
            const double away = spread * std::sqrt(random_.uniform());
            const Vector middle = limb.at(0.2 + 0.8 * share) + random_.direction() * away;
            add_leaf(middle, limb.direction(share), length * random_.uniform(0.75, 1.2), slender);
        }
    }

    void add_leaf(const Vector& middle, const Vector& along, double length, double slender) {
        const Vector out = unit(Vector{middle[0], 0.2, middle[2]});
        const Vector normal = unit(random_.direction() * 0.8 + upwards * 0.5 + out * 0.4);
        const Vector wish = along * (conifer_ ? 0.8 : 0.4) + random_.direction() + upwards * (conifer_ ? -0.2 : -0.3);
        const Vector forward = unit(wish - normal * dot(wish, normal)), side = cross(normal, forward);
        const uint32_t root = put_vertex(tree_.leaves, middle - forward * (0.5 * length));
        const uint32_t right = put_vertex(tree_.leaves, middle + side * (0.5 * slender * length));
        const uint32_t tip = put_vertex(tree_.leaves, middle + forward * (0.5 * length));
        const uint32_t left = put_vertex(tree_.leaves, middle - side * (0.5 * slender * length));
        tree_.leaves.triangles.push_back({root, right, tip});
        tree_.leaves.triangles.push_back({root, tip, left});
    }

    bool conifer_;
    uint64_t triangles_;
    double height_, crown_base_, crown_radius_;  // the base of the crown as a share of the height
    Random& random_;
    Limb trunk_;
    std::vector<Limb> limbs_;
    Tree tree_;
};

}  // namespace

Tree grow_tree(TreeHabit habit, uint64_t triangles, Random& random) {
    RAYPAGER_CHECK(triangles >= min_tree_triangles);
    return TreeGrower(habit, triangles, random).grow();
}

TriangleMesh grow_tuft(uint64_t triangles, Random& random) {
    TriangleMesh mesh;
    const uint64_t blades = triangles / 3;
    RAYPAGER_CHECK(blades > 0);
    const double width = std::clamp(0.3 / std::sqrt(static_cast<double>(blades)), 0.006, 0.06);
    for (uint64_t i = 0; i < blades; i++) {
        const double off = std::sqrt(random.uniform()), turn = random.uniform();
        const Vector out = heading(turn), across = heading(turn + random.uniform(0.1, 0.4)) * (0.5 * width);
        const Vector root = out * (0.55 * off) - upwards * 0.06;
        const double height = random.uniform(0.22, 0.62) * (1.15 - 0.5 * off), lean = random.uniform(0.1, 0.75) * height;
        const Vector knee = root + upwards * (0.6 * height) + out * (0.35 * lean), tip = root + upwards * height + out * lean;
        const uint32_t a = put_vertex(mesh, root - across), b = put_vertex(mesh, root + across);
        const uint32_t c = put_vertex(mesh, knee - across * 0.8), d = put_vertex(mesh, knee + across * 0.8), e = put_vertex(mesh, tip);
        for (const Triangle& t : {Triangle{a, b, c}, Triangle{c, b, d}, Triangle{c, d, e}}) mesh.triangles.push_back(t);
    }
    return mesh;
}

TriangleMesh make_rock(uint64_t triangles, Random& random) {
    // A ball of n segments has n * n triangles, if n is even.
    const auto half = static_cast<uint32_t>(0.5 * std::sqrt(static_cast<double>(triangles)));
    TriangleMesh mesh;
    add_ball(mesh, {}, 0.5, 2 * std::max(half, 3u));
    const uint64_t seed = random.bits();
    const Vector stretch = {random.uniform(0.8, 1.3), random.uniform(0.55, 0.85), random.uniform(0.8, 1.3)};
    for (Float3& p : mesh.positions) {
        const Vector v = vector(p);
        const double lumps = fractal_noise(v * 2.1, 2, 0.5, seed), cracks = ridged_noise(v * 4.3, 4, 0.55, seed + 9);
        const Vector moved = v * (1 + 0.45 * lumps - 0.16 * cracks);
        p = float3({moved[0] * stretch[0], moved[1] * stretch[1], moved[2] * stretch[2]});
    }
    return mesh;
}

}  // namespace raypager
