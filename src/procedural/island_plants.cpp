#include "procedural/island_plants.hpp"

#include <algorithm>
#include <cmath>

#include "base/check.hpp"
#include "procedural/limbs.hpp"
#include "procedural/parts.hpp"

namespace raypager {
namespace {

constexpr double turn_of_leaves = 0.381966011250105;  // the golden angle

// A strip that ends in a point: 2 * steps - 1 triangles. It bends downwards towards its tip.
struct Blade {
    Vector root, along, across;  // unit vectors; across is its width's direction
    double length, width, droop;
    size_t steps;
};

void add_blade(TriangleMesh& mesh, const Blade& blade) {
    uint32_t left = 0, right = 0;
    for (size_t i = 0; i <= blade.steps; i++) {
        const double t = static_cast<double>(i) / static_cast<double>(blade.steps);
        const Vector middle = blade.root + blade.along * (blade.length * t) - upwards * (blade.droop * t * t);
        if (i == blade.steps) {
            mesh.triangles.push_back({left, right, put_vertex(mesh, middle)});
            return;
        }
        const Vector half = blade.across * (0.5 * blade.width * (1 - 0.6 * t * t));
        const uint32_t l = put_vertex(mesh, middle - half), r = put_vertex(mesh, middle + half);
        if (i > 0) {
            mesh.triangles.push_back({left, right, l});
            mesh.triangles.push_back({l, right, r});
        }
        left = l;
        right = r;
    }
}

size_t blade_steps(uint64_t triangles) { return std::max<size_t>(1, (triangles + 1) / 2); }

uint32_t put_uv_vertex(TriangleMesh& mesh, const Vector& p, double u, double v) {
    mesh.uvs.push_back({static_cast<float>(u), static_cast<float>(v)});
    return put_vertex(mesh, p);
}

class PalmGrower {
public:
    PalmGrower(uint64_t triangles, Random& random) : triangles_(triangles), random_(random) {}

    Palm grow() {
        const Limb trunk = add_trunk();
        const Vector top = trunk.at(0.985);
        if (triangles_ > 4000) add_nuts(top);
        const uint64_t left = triangles_ - std::min<uint64_t>(triangles_, palm_.wood.triangles.size());
        const uint64_t fronds = std::clamp<uint64_t>(triangles_ / 40, 6, 24);
        for (uint64_t i = 0; i < fronds; i++) {
            const double age = (static_cast<double>(i) + random_.uniform()) / static_cast<double>(fronds);  // the oldest hang
            add_frond(top, heading(turn_of_leaves * static_cast<double>(i) + random_.uniform(0, 0.08)), 1.3 - 1.55 * age, left / fronds);
        }
        return std::move(palm_);
    }

private:
    Limb add_trunk() {
        const uint64_t wood = std::max<uint64_t>(triangles_ * 15 / 100, 24);
        const auto sides = static_cast<uint32_t>(std::clamp(std::sqrt(static_cast<double>(wood) / 8), 4.0, 20.0));
        const size_t steps = std::max<size_t>(3, wood / sides / 2);
        const double height = random_.uniform(7, 14), lean = height * random_.uniform(0.1, 0.5);
        const Vector side = heading(random_.uniform());
        Limb trunk;
        trunk.length = height;
        trunk.radius = random_.uniform(0.15, 0.21);
        for (size_t i = 0; i <= steps; i++) {
            const double t = static_cast<double>(i) / static_cast<double>(steps);
            trunk.path.push_back(side * (lean * t * (1 - 0.35 * t)) + upwards * (height * t - 0.5));  // its roots are in the ground, also on slopes
        }
        add_limb(palm_.wood, trunk, sides, 0.45);
        return trunk;
    }

    void add_nuts(const Vector& top) {
        for (int i = 0; i < 6; i++) {
            const double below = random_.uniform(0.15, 0.4);
            add_ball(palm_.wood, Pose{top + heading(i / 6.0 + random_.uniform(0, 0.1)) * 0.24 - upwards * below}, 0.13, 6);
        }
    }

    // lift: of its beginning, as a tangent of sorts.
    void add_frond(const Vector& top, const Vector& out, double lift, uint64_t triangles) {
        const size_t steps = 14;
        const double reach = random_.uniform(3.6, 5.0);
        Limb stalk{{top}, 0.035, reach};
        Vector direction = unit(out + upwards * lift);
        for (size_t i = 0; i < steps; i++) {
            direction = unit(direction - upwards * (1.45 / steps) + random_.direction() * 0.02);
            stalk.path.push_back(stalk.path.back() + direction * (reach / steps));
        }
        if (triangles > 400) {
            add_limb(palm_.leaves, stalk, 3);
            triangles -= 3 * (2 * steps - 1);
        }
        // One triangle each where there are few, else three or more, which bend.
        const uint64_t leaflets = triangles < 60 ? std::max<uint64_t>(triangles, 8) : std::clamp<uint64_t>(triangles / 3, 20, 110),
                       pairs = leaflets / 2;
        const double width = std::min(0.9 * reach / static_cast<double>(pairs), 0.45);
        for (uint64_t i = 0; i < 2 * pairs; i++) {
            const uint64_t pair = i / 2;
            const double t = (static_cast<double>(pair) + 0.5) / static_cast<double>(pairs), share = 0.1 + 0.9 * t;
            const Vector along = stalk.direction(std::min(share, 0.999)), side = unit(cross(along, upwards)) * (i % 2 == 0 ? 1 : -1);
            const double size = reach * 0.23 * (0.35 + 3.0 * t * (1.02 - t)) * random_.uniform(0.85, 1.1);
            const Vector away = unit(side + along * (0.35 + 0.9 * t) - upwards * random_.uniform(0.1, 0.35));
            add_blade(palm_.leaves, {stalk.at(std::min(share, 0.999)), away, along, size, width, 0.22 * size, blade_steps(triangles / leaflets)});
        }
    }

    uint64_t triangles_;
    Random& random_;
    Palm palm_;
};

void add_flower(TriangleMesh& mesh, const Vector& middle, const Vector& facing, double size, Random& random) {
    const Pose pose = Pose::along(middle, facing, random.uniform());
    const double h = 0.5 * size;
    const uint32_t a = put_uv_vertex(mesh, pose.at(-h, 0, h), 0, 0);
    put_uv_vertex(mesh, pose.at(h, 0, h), 1, 0);
    put_uv_vertex(mesh, pose.at(h, 0, -h), 1, 1);
    put_uv_vertex(mesh, pose.at(-h, 0, -h), 0, 1);
    mesh.triangles.push_back({a, a + 1, a + 2});
    mesh.triangles.push_back({a, a + 2, a + 3});
}

void add_diamond(TriangleMesh& mesh, const Vector& middle, const Vector& normal, double length, Random& random) {
    const Pose pose = Pose::along(middle, normal, random.uniform());
    const uint32_t a = put_vertex(mesh, pose.at(-0.5 * length, 0, 0));
    put_vertex(mesh, pose.at(0, 0, 0.26 * length));
    put_vertex(mesh, pose.at(0.5 * length, 0, 0));
    put_vertex(mesh, pose.at(0, 0, -0.26 * length));
    mesh.triangles.push_back({a, a + 1, a + 2});
    mesh.triangles.push_back({a, a + 2, a + 3});
}

}  // namespace

Palm grow_palm(uint64_t triangles, Random& random) {
    RAYPAGER_CHECK(triangles >= min_palm_triangles);
    return PalmGrower(triangles, random).grow();
}

TriangleMesh grow_rosette(uint64_t triangles, Random& random) {
    RAYPAGER_CHECK(triangles >= min_rosette_triangles);
    TriangleMesh mesh;
    const uint64_t blades = std::clamp<uint64_t>(triangles / 5, 5, 90);
    const double width = std::clamp(0.6 / std::sqrt(static_cast<double>(blades)), 0.07, 0.2), size = random.uniform(0.8, 1.3);
    for (uint64_t i = 0; i < blades; i++) {
        const Vector out = heading(turn_of_leaves * static_cast<double>(i) + random.uniform(0, 0.1));
        const double lift = 0.15 + 2.2 * static_cast<double>(i) / static_cast<double>(blades);
        const Vector along = unit(out + upwards * lift), across = unit(cross(along, upwards));
        const double reach = size * random.uniform(0.8, 1.2);
        add_blade(mesh, {upwards * -0.05, along, across, reach, width, reach * random.uniform(0.2, 0.7), blade_steps(triangles / blades)});
    }
    return mesh;
}

TriangleMesh grow_fern(uint64_t triangles, Random& random) {
    RAYPAGER_CHECK(triangles >= min_fern_triangles);
    TriangleMesh mesh;
    const uint64_t fronds = std::clamp<uint64_t>(triangles / 16, 3, 16), steps = std::max<uint64_t>(1, triangles / 4 / fronds);
    for (uint64_t i = 0; i < fronds; i++) {
        const Vector out = heading(turn_of_leaves * static_cast<double>(i) + random.uniform(0, 0.1));
        const Vector along = unit(out + upwards * random.uniform(0.4, 1.6)), side = unit(cross(along, upwards));
        const double reach = random.uniform(0.8, 1.3), half = 0.2 * reach, droop = reach * random.uniform(0.3, 0.8);
        uint32_t before = 0;
        for (uint64_t j = 0; j <= steps; j++) {
            const double t = static_cast<double>(j) / static_cast<double>(steps);
            const Vector middle = along * (reach * t) - upwards * (droop * t * t + 0.03);
            const uint32_t row = put_uv_vertex(mesh, middle - side * half - upwards * (0.25 * half), 0, t);
            put_uv_vertex(mesh, middle, 0.5, t);
            put_uv_vertex(mesh, middle + side * half - upwards * (0.25 * half), 1, t);
            for (uint32_t k = 0; k < 2 && j > 0; k++) {
                mesh.triangles.push_back({before + k, before + k + 1, row + k + 1});
                mesh.triangles.push_back({before + k, row + k + 1, row + k});
            }
            before = row;
        }
    }
    return mesh;
}

Hedge grow_hedge(uint64_t triangles, Random& random) {
    RAYPAGER_CHECK(triangles >= min_hedge_triangles);
    Hedge hedge;
    const uint64_t flowers = std::min<uint64_t>(std::max<uint64_t>(triangles / 20, 2), 400), leaves = triangles / 2 - flowers;
    const Vector radii = {random.uniform(0.8, 1.3), random.uniform(0.7, 1.2), random.uniform(0.8, 1.3)};
    // However many leaves there are, they cover the same area.
    const double length = std::min(std::sqrt(2 * 14.0 / (0.52 * static_cast<double>(leaves))), 0.8);
    const auto somewhere = [&](double inner) {
        Vector d = random.direction();
        d[1] = std::abs(d[1]);
        return std::pair(d, Vector{d[0] * radii[0], 0.15 + d[1] * radii[1], d[2] * radii[2]} * random.uniform(inner, 1));
    };
    for (uint64_t i = 0; i < leaves; i++) {
        const auto [out, middle] = somewhere(0.7);
        const double size = length * random.uniform(0.7, 1.2);
        add_diamond(hedge.leaves, middle, unit(out + random.direction() * 0.7), size, random);
    }
    for (uint64_t i = 0; i < flowers; i++) {
        const auto [out, middle] = somewhere(1.0);
        const double size = random.uniform(0.12, 0.2);
        add_flower(hedge.flowers, middle + out * 0.05, unit(out + random.direction() * 0.4), size, random);
    }
    return hedge;
}

TriangleMesh make_fallen_leaf(Random& random) {
    TriangleMesh mesh;
    add_blade(mesh, {{-0.5, 0.02, 0}, unit({1, 0.25, 0}), {0, 0, 1}, 1, random.uniform(0.25, 0.5), 0.25, blade_steps(fallen_leaf_triangles)});
    return mesh;
}

}  // namespace raypager
