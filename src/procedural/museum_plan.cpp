#include "procedural/museum_plan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

namespace raypager {
namespace {

// Adds images one by one.
class ImageList {
public:
    ImageList(std::vector<MuseumImage>& images, uint64_t seed) : images_(images), random_(seed, 21), seed_(mix_bits(seed)) {}

    uint32_t covering(const std::string& name, Covering covering, double area, double aspect = 1) {
        MuseumImage image = any(name, area, aspect);
        image.covering = covering;
        return add(std::move(image));
    }
    uint32_t painting(const std::string& name, double width, double height) {
        MuseumImage image = any(name, width * height, width / height);
        image.painting = true;
        return add(std::move(image));
    }
    // Two images that show the same thing.
    void share_seed(uint32_t a, uint32_t b) { images_[b].seed = images_[a].seed; }

private:
    MuseumImage any(const std::string& name, double area, double aspect) {
        MuseumImage image;
        image.name = name;
        image.aspect = aspect;
        image.seed = mix_bits(seed_ + images_.size());
        image.powers_of_two = random_.below(2) == 0;
        // Some were photographed from nearer by than others.
        constexpr std::array<double, 5> sharpness = {0.3, 0.6, 1, 1.6, 3};
        image.area = area * sharpness[random_.below(sharpness.size())];
        return image;
    }
    uint32_t add(MuseumImage image) {
        images_.push_back(std::move(image));
        return static_cast<uint32_t>(images_.size() - 1);
    }
    std::vector<MuseumImage>& images_;
    Random random_;
    uint64_t seed_;
};

// How the pictures of a bay's wall hang: lower left corner and size of each slot, as shares.
using Slot = std::array<double, 4>;
const std::vector<std::vector<Slot>> hangings = {
    {{0.06, 0.04, 0.88, 0.92}},
    {{0, 0.1, 0.48, 0.8}, {0.52, 0.1, 0.48, 0.8}},
    {{0, 0, 0.56, 1}, {0.6, 0.52, 0.4, 0.48}, {0.6, 0, 0.4, 0.48}},
    {{0, 0, 0.5, 0.5}, {0.5, 0, 0.5, 0.5}, {0, 0.5, 0.5, 0.5}, {0.5, 0.5, 0.5, 0.5}},
    {{0.29, 0, 0.42, 1}, {0, 0.5, 0.28, 0.5}, {0, 0, 0.28, 0.5}, {0.72, 0.5, 0.28, 0.5}, {0.72, 0, 0.28, 0.5}},
    {{0, 0, 0.33, 0.5}, {0.33, 0, 0.34, 0.5}, {0.67, 0, 0.33, 0.5}, {0, 0.5, 0.33, 0.5}, {0.33, 0.5, 0.34, 0.5}, {0.67, 0.5, 0.33, 0.5}}};

// A part of a wall on which one hanging has room.
constexpr double panel_width = 4, panel_height = 3.1, panel_above_floor = 0.95;

// Their lower left corners: those of the end wall, which is looked at straight on, then from the entrance on.
std::vector<Pose> panels_of(const MuseumPlan& plan) {
    std::vector<Pose> panels;
    const double x = plan.half_width();
    for (uint32_t storey = 0; storey < plan.storeys; storey++) {
        const double y = MuseumPlan::storey * storey + panel_above_floor;
        for (const double side : {-1.0, 1.0})
            panels.push_back({{side * 0.5 * x - 0.5 * panel_width, y, -plan.length()}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}});
    }
    const double margin_of_bay = 0.5 * (MuseumPlan::bay - panel_width);
    for (uint32_t bay = 0; bay < plan.bays; bay++)
        for (uint32_t storey = 0; storey < plan.storeys; storey++) {
            const double y = MuseumPlan::storey * storey + panel_above_floor, z = -MuseumPlan::bay * bay;
            panels.push_back({{-x, y, z - margin_of_bay}, {0, 0, -1}, {0, 1, 0}, {1, 0, 0}});
            panels.push_back({{x, y, z - MuseumPlan::bay + margin_of_bay}, {0, 0, 1}, {0, 1, 0}, {-1, 0, 0}});
        }
    return panels;
}

// Sizes of hangings until there is a slot for each painting.
std::vector<uint32_t> pick_hangings(size_t paintings, Random& random) {
    std::vector<uint32_t> sizes;
    for (size_t left = paintings; left > 0; left -= sizes.back()) {
        const uint32_t size = 1 + random.below(static_cast<uint32_t>(hangings.size()));
        sizes.push_back(static_cast<uint32_t>(std::min<size_t>(size, left)));
    }
    return sizes;
}

// A hall that is longer than it is high, and not more than it must be.
void size_hall(size_t panels, MuseumPlan& plan) {
    plan.storeys = static_cast<uint32_t>(std::clamp(std::sqrt(static_cast<double>(panels) / 10) + 0.3, 1.0, 24.0));
    const size_t on_side_walls = panels > 2 * plan.storeys ? panels - 2 * plan.storeys : 0;
    plan.bays = std::max<uint32_t>(3, static_cast<uint32_t>((on_side_walls + 2 * plan.storeys - 1) / (2 * plan.storeys)));
}

void hang(MuseumPlan& plan, std::vector<MuseumPainting>& paintings, Random& random) {
    const std::vector<uint32_t> sizes = pick_hangings(paintings.size(), random);
    size_hall(sizes.size(), plan);
    const std::vector<Pose> panels = panels_of(plan);
    size_t next = 0;
    for (size_t panel = 0; panel < sizes.size(); panel++)
        for (const Slot& slot : hangings[sizes[panel] - 1]) {
            MuseumPainting& painting = paintings[next++];
            constexpr double room = 0.3;  // for frames, and for some wall between them
            const double w = slot[2] * panel_width - room, h = slot[3] * panel_height - room;
            const double narrower = random.uniform(0.72, 1), lower = random.uniform(0.78, 1);
            painting.width = w * narrower;
            painting.height = h * lower;
            const double x = slot[0] * panel_width + 0.5 * room + 0.5 * (w - painting.width);
            const double y = slot[1] * panel_height + 0.5 * room + 0.5 * (h - painting.height);
            painting.corner = panels[panel].moved(x, y, 0);
        }
}

void add_building(ImageList& list, MuseumPlan& plan) {
    MuseumBuilding& b = plan.building;
    b.floor = list.covering("floor", Covering::tiles, 9);
    b.floor_roughness = list.covering("floor-rough", Covering::worn_tiles, 9);
    b.wall = list.covering("wall", Covering::plaster, 6);
    b.ceiling = list.covering("ceiling", Covering::planks, 6);
    b.column = list.covering("column", Covering::marble, 2, 0.5);
    b.pedestal = list.covering("pedestal", Covering::marble, 1);
    b.bench = list.covering("bench", Covering::planks, 1);
    b.pot = list.covering("pot", Covering::clay, 1, 2);
    b.gilt_roughness = list.covering("gilt-rough", Covering::brushed, 0.5, 2);
    b.dark_roughness = list.covering("dark-rough", Covering::brushed, 0.5, 2);
}

// How many paintings there are, and which have images beside their picture, so that exactly so many images are used. A third is matte, a third
// is varnished in a way that varies, a third has a metal frame of its own.
std::vector<MuseumPainting> divide_among_paintings(uint64_t images) {
    std::vector<MuseumPainting> paintings;
    for (uint32_t kind = 0; images > 0; kind = (kind + 1) % 3) {
        MuseumPainting painting{};
        painting.picture = 0;
        images--;
        // Any number but no_image stands for an image that is yet to be named.
        if (kind != 0 && images > 0) {
            (kind == 1 ? painting.roughness : painting.frame_roughness) = 0;
            images--;
        }
        paintings.push_back(painting);
    }
    return paintings;
}

constexpr uint32_t lowest_side = 64, highest_side = 16384;
constexpr double least_density = 1e-3, most_density = 1e14;  // beyond, all sides are the lowest or the highest

// One side, of so many texels if that may be.
uint32_t rounded_side(double side, bool power_of_two) {
    const auto whole = static_cast<uint32_t>(std::clamp(side, double{lowest_side}, double{highest_side}));
    if (power_of_two) return std::bit_floor(whole);
    return std::min(whole | 1, highest_side - 1);
}

void size_image(MuseumImage& image, double texels_a_square_metre) {
    const double area = image.area * texels_a_square_metre;
    image.width = rounded_side(std::sqrt(area * image.aspect), image.powers_of_two);
    image.height = rounded_side(std::sqrt(area / image.aspect), image.powers_of_two);
}

uint64_t total_bytes(const std::vector<MuseumImage>& images) {
    uint64_t total = 0;
    for (const MuseumImage& image : images) total += image.bytes();
    return total;
}

// The largest density of texels at which all images take no more than bytes. Only images whose sides can be any are sized if odd_only.
void fit_images(std::vector<MuseumImage>& images, uint64_t bytes, bool odd_only) {
    const auto size_all = [&](double density) {
        for (MuseumImage& image : images)
            if (!odd_only || !image.powers_of_two) size_image(image, density);
        return total_bytes(images);
    };
    double low = least_density, high = most_density;
    for (int step = 0; step < 120; step++) {
        const double middle = std::sqrt(low * high);
        (size_all(middle) <= bytes ? low : high) = middle;
    }
    size_all(low);
}

}  // namespace

Vector MuseumPlan::site(uint32_t index) const {
    const uint32_t at = index % sites_a_bay(), row = at / 4, bays = index / sites_a_bay();
    const double side = at % 2 == 0 ? -1 : 1, z = -bay * bays - (at % 4 < 2 ? 0.3 : 0.8) * bay;
    return {side * (half_width() - 2.1 - 2 * row), 0, z};
}

MuseumPlan plan_museum(uint64_t textures, uint64_t seed) {
    MuseumPlan plan;
    Random random(seed, 20);
    ImageList list(plan.images, seed);
    add_building(list, plan);
    const uint64_t kinds = std::clamp<uint64_t>(textures / 40, 1, 48), statues = textures / 20 + 1;
    for (uint64_t i = 0; i < kinds; i++) {
        MuseumPlant plant{};
        plant.leaf = list.covering(fmt::format("leaf-{:02}", i), Covering::leaf, 0.3, 0.5);
        plant.mask = list.covering(fmt::format("leaf-mask-{:02}", i), Covering::leaf_mask, 0.3, 0.5);
        list.share_seed(plant.leaf, plant.mask);
        plan.plants.push_back(plant);
    }
    for (uint64_t i = 0; i < statues && plan.images.size() < textures; i++) {
        MuseumStatue statue{};
        statue.stone = list.covering(fmt::format("statue-{:04}", i), Covering::marble, 2);
        if (i % 3 == 1 && plan.images.size() < textures) statue.roughness = list.covering(fmt::format("statue-rough-{:04}", i), Covering::brushed, 1);
        plan.statues.push_back(statue);
    }
    plan.paintings = divide_among_paintings(textures - plan.images.size());
    hang(plan, plan.paintings, random);
    for (size_t i = 0; i < plan.paintings.size(); i++) {
        MuseumPainting& p = plan.paintings[i];
        p.picture = list.painting(fmt::format("painting-{:05}", i), p.width, p.height);
        const double area = p.width * p.height, aspect = p.width / p.height;
        if (p.roughness != no_image) p.roughness = list.covering(fmt::format("varnish-{:05}", i), Covering::brushed, area, aspect);
        if (p.frame_roughness != no_image) p.frame_roughness = list.covering(fmt::format("frame-{:05}", i), Covering::brushed, 0.5, 2);
    }
    return plan;
}

Status size_images(std::vector<MuseumImage>& images, uint64_t bytes) {
    const auto total_at = [&](double density) {
        for (MuseumImage& image : images) size_image(image, density);
        return total_bytes(images);
    };
    const uint64_t lowest = total_at(least_density), highest = total_at(most_density);
    if (bytes < lowest || bytes > highest)
        return Status::usage(fmt::format("{} textures of {} to {} texels a side take {} to {} bytes, not {}", images.size(), lowest_side,
                                         highest_side, lowest, highest, bytes));
    // Powers of two are in steps of four times the texels; the others then make up for what these leave.
    fit_images(images, bytes, false);
    fit_images(images, bytes, true);
    if (total_bytes(images) >= bytes - bytes / 20) return {};
    for (MuseumImage& image : images) image.powers_of_two = false;
    fit_images(images, bytes, false);
    return {};
}

}  // namespace raypager
