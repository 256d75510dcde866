#include "procedural/island_layers.hpp"

#include <algorithm>
#include <cmath>

#include "procedural/noise.hpp"

namespace raypager {
namespace {

// What things look at when they choose where to be.
struct Site {
    double x, z;
    IslandLand::Footing footing;
    double inland;  // in widths of the beach
    double close;   // 1 where one looks from, 0 far from there
    double level() const { return footing.normal[1]; }
};

class IslandLayers {
public:
    IslandLayers(SceneWriter& scene, const IslandPlan& plan, const IslandLand& land, uint64_t seed)
        : scene_(scene), plan_(plan), land_(land), seed_(seed), noise_(mix_bits(seed + 17)) {}

    Status write() const {
        for (size_t i = 0; i < island_things; i++) RAYPAGER_TRY(write(static_cast<IslandThing>(i)));
        return {};
    }

private:
    Status write(IslandThing thing) const {
        const IslandKind& kind = plan_[thing];
        const double half = land_.half();
        Layer layer{kind.name, kind.kinds, kind.instances, {}, {}};
        // Places of layers are counted from a corner of the land, stances from its middle.
        layer.density = [&](double x, double z) {
            const Site site = site_at(x - half, z - half);
            return likes(thing, site) * (1 + crowd(thing) * site.close) + 1e-9;  // somewhere, even if the cells miss all places that would do
        };
        const double cell = 2 * half / std::ceil(std::sqrt(2.0 * static_cast<double>(std::max<uint64_t>(kind.instances, 1))));
        layer.place = [&](double x, double z, Random& random) {
            const Site site = settle(thing, x - half, z - half, cell, random);
            Stance stance = stance_of(thing, site, random);
            return std::pair<uint64_t, Stance>(random.below(static_cast<uint32_t>(kind.kinds)), stance);
        };
        return write_layer(scene_, layer, {2 * half, land_.eye()}, seed_);
    }

    Site site_at(double x, double z) const {
        const double dx = x - land_.bay()[0], dz = z - land_.bay()[2], reach = 1.6 * land_.beach();
        const double far = (dx * dx + dz * dz) / (reach * reach);
        return {x, z, land_.footing(x, z), land_.inland(x, z) / land_.beach(), 1 / ((1 + far) * (1 + far))};
    }

    // How many more there are where one looks from: what is small is not seen elsewhere.
    static double crowd(IslandThing thing) {
        switch (thing) {
            case IslandThing::pebble:
            case IslandThing::shell:
            case IslandThing::coral:
            case IslandThing::litter:
                return 12;
            case IslandThing::tuft:
                return 25;
            case IslandThing::driftwood:
            case IslandThing::boulder:
            case IslandThing::tree:
                return 0;
            default:
                return 6;
        }
    }

    double patch(const Site& site, double metres, uint64_t number) const {
        return value_noise(site.x / metres, site.z / metres, noise_ + number).value;
    }
    // Of what stands high, some is left out where it would hide the mountains.
    double view(const Site& site) const {
        const double ahead = (land_.bay()[2] - site.z) / land_.beach(), aside = std::abs(site.x - land_.eye()[0]) / land_.beach();
        return ahead > 6 ? 1 : smooth_step(0.5, 1.4, aside);
    }

    // 0 to 1: how well a place suits.
    double likes(IslandThing thing, const Site& site) const {
        const double d = site.inland, level = site.level();
        if (d <= 0) return 0;
        switch (thing) {
            case IslandThing::pebble:
                return smooth_step(0.01, 0.06, d) * smooth_step(1.2, 0.5, d) * (0.1 + smooth_step(0, 0.6, patch(site, 4, 1)));
            case IslandThing::shell:
            case IslandThing::coral:
                return smooth_step(0.02, 0.08, d) * smooth_step(0.8, 0.3, d) * (0.15 + smooth_step(-0.1, 0.5, patch(site, 5, 2)));
            case IslandThing::driftwood:
                return smooth_step(0.1, 0.3, d) * smooth_step(1, 0.7, d);
            case IslandThing::boulder:
                return 0.3 * smooth_step(0.5, 0.75, patch(site, 30, 3)) * smooth_step(0, 0.2, d) +
                       0.5 * smooth_step(0.8, 0.6, level) * smooth_step(1, 2, d);
            case IslandThing::litter:
                return smooth_step(0.5, 0.9, d) * smooth_step(9, 2, d) + 0.01 * smooth_step(0.9, 1, d);
            case IslandThing::tuft:
                return smooth_step(0.65, 1.0, d + 0.15 * patch(site, 3, 4)) * (0.2 + smooth_step(-0.5, 0.4, patch(site, 6, 5)));
            case IslandThing::rosette:
                return smooth_step(0.6, 0.85, d) * (smooth_step(4.5, 1.5, d) + 0.04) * smooth_step(-0.3, 0.4, patch(site, 8, 6)) *
                       smooth_step(0.6, 0.8, level);
            case IslandThing::fern:
                return smooth_step(1.0, 1.6, d) * smooth_step(0.45, 0.7, level);
            case IslandThing::hedge:
                return smooth_step(0.9, 1.15, d) * (smooth_step(5, 2, d) + 0.15) * smooth_step(-0.2, 0.35, patch(site, 11, 7)) *
                       smooth_step(0.5, 0.75, level);
            case IslandThing::palm:
                return smooth_step(0.55, 0.9, d) * (smooth_step(6, 2.5, d) + 0.08) * smooth_step(0.7, 0.85, level) * view(site);
            case IslandThing::tree:
                return smooth_step(1.3, 2.4, d) * smooth_step(0.42, 0.72, level + 0.12 * patch(site, 25, 8)) * view(site);
        }
        return 0;
    }

    // The cell of a layer is larger than a beach is wide: near that place, where it suits. There is always land towards the island's middle.
    Site settle(IslandThing thing, double x, double z, double cell, Random& random) const {
        constexpr int tries = 24;
        Site best = site_at(x, z);
        double best_likes = likes(thing, best);
        if (best_likes > random.uniform()) return best;
        for (int i = 0; i < tries; i++) {
            const double spread = cell * (0.5 + 0.15 * i);
            const auto near = [&](double place) { return std::clamp(place + random.uniform(-spread, spread), -land_.half(), land_.half()); };
            const double near_x = near(x);
            const Site site = site_at(near_x, near(z));
            const double suits = likes(thing, site);
            if (suits > random.uniform()) return site;
            if (suits > best_likes) {
                best_likes = suits;
                best = site;
            }
        }
        if (best_likes > 0) return best;
        const double r = std::max(std::sqrt(x * x + z * z), 1e-9), at = (r + land_.inland(x, z) - land_.beach()) / r;
        return site_at(x * at, z * at);
    }

    Stance stance_of(IslandThing thing, const Site& site, Random& random) const {
        const Vector ground = {site.x, site.footing.height, site.z}, slope = site.footing.normal, wild = random.direction();
        const auto standing = [&](double low, double high, double tilt) {
            const double size = random.uniform(low, high);
            Stance stance = turned_stance(ground, unit(Vector{0, 1, 0} + wild * tilt), random);
            if (random.below(3) == 0) stance.x = stance.x * -1;  // mirrored
            return scaled(stance, size, size * random.uniform(0.85, 1.15));
        };
        // Its middle above the ground by a share of its size.
        const auto lying = [&](double low, double high, double tumble, double above) {
            const double u = random.uniform(), size = low + (high - low) * u * u * u;
            const Vector up = unit(slope + wild * tumble);
            const double height = size * random.uniform(0.8, 1.2);
            return scaled(turned_stance(ground + Vector{0, above * size, 0}, up, random), size, height);
        };
        switch (thing) {
            case IslandThing::pebble:
                return lying(0.03, 0.28, 0.4, 0.12);
            case IslandThing::boulder:
                return lying(0.5, 4, 0.4, 0.05);
            case IslandThing::shell:
                return lying(0.05, 0.22, 0.3, 0.2);
            case IslandThing::coral:
                return lying(0.08, 0.45, 0.5, 0.1);
            case IslandThing::driftwood:
                return lying(0.7, 3.2, 0.05, 0.03);
            case IslandThing::litter:
                return lying(0.08, 0.4, 0.2, 0.02);
            case IslandThing::tuft: {
                const double size = random.uniform(0.6, 1.5), height = size * random.uniform(0.7, 1.3);
                return scaled(turned_stance(ground, slope, random), size, height);
            }
            case IslandThing::rosette:
                return standing(0.7, 1.6, 0.1);
            case IslandThing::fern:
                return standing(0.7, 1.7, 0.1);
            case IslandThing::hedge:
                return standing(0.6, 1.6, 0.08);
            case IslandThing::palm:
                return standing(0.65, 1.15, 0.08);
            case IslandThing::tree: {  // low beside the sea
                const double grown = 0.5 + 0.5 * smooth_step(1.5, 8, site.inland);
                return standing(0.4 * grown, 1.1 * grown, 0.05);
            }
        }
        return {};
    }

    SceneWriter& scene_;
    const IslandPlan& plan_;
    const IslandLand& land_;
    uint64_t seed_, noise_;
};

}  // namespace

Status write_island_layers(SceneWriter& scene, const IslandPlan& plan, const IslandLand& land, uint64_t seed) {
    return IslandLayers(scene, plan, land, seed).write();
}

}  // namespace raypager
