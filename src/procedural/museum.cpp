// A museum: a hall of pictures, statues and plants, whose images take far more room than their geometry. Made for measuring how textures are
// paged, at any size. Metres; y up, the camera looks along -z.
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <mutex>

#include "base/parallel.hpp"
#include "procedural/kinds.hpp"
#include "procedural/museum_parts.hpp"
#include "procedural/museum_plan.hpp"
#include "procedural/paintings.hpp"

namespace raypager {
namespace {

constexpr double entrance = 6;         // the hall goes on so far in front of its first bay, and is open there
constexpr size_t images_at_once = 16;  // each takes up to 4 MiB while it is written, mostly tables of its noises

Status write_image(const MuseumImage& image, const MakeSceneOptions& options, std::atomic<uint64_t>& written) {
    const auto painter = image.painting ? make_painting(image.width, image.height, image.aspect, image.seed)
                                        : make_covering(image.covering, image.width, image.height, image.seed);
    const auto bytes = write_image_file(options.directory / image.file(), *painter);
    if (!bytes) return bytes.status();
    written += *bytes;
    return {};
}

Status write_images(const MuseumPlan& plan, const MakeSceneOptions& options, SceneWriter& scene) {
    uint64_t total = 0, done = 0;
    for (const MuseumImage& image : plan.images) total += image.bytes();
    std::atomic<uint64_t> written = 0;
    std::mutex mutex;
    const auto write_some = [&](size_t begin, size_t end) -> Status {
        for (size_t i = begin; i < end; i++) {
            RAYPAGER_TRY(write_image(plan.images[i], options, written));
            const std::lock_guard lock(mutex);
            done += plan.images[i].bytes();
            if (options.progress) options.progress(static_cast<double>(done) / static_cast<double>(total));
        }
        return {};
    };
    RAYPAGER_TRY(parallel_try(plan.images.size(), 1, write_some, images_at_once));
    scene.count_images(plan.images.size(), total, written);
    return {};
}

// How many there are of what has no images of its own.
struct MuseumCounts {
    explicit MuseumCounts(const MuseumPlan& plan) {
        const uint64_t free_sites = plan.sites() - std::min<uint64_t>(plan.sites(), plan.statues.size());
        plants = std::max<uint64_t>(plan.plants.size(), std::min<uint64_t>(plan.bays + 2, free_sites));
        benches = (plan.bays + 1) / 2;
        columns = 2 * (plan.bays + 1);
        const uint64_t blocks = 2 * plan.storeys + columns * (plan.storeys - 1) + plan.statues.size() + 3 * benches;
        const uint64_t panels = 5 + plan.bays + plan.paintings.size();
        least_triangles = block_triangles * blocks + panel_triangles * panels + frame_triangles(false) * plan.paintings.size() +
                          least_column * columns + (least_pot + 2 * least_leaves) * plants + least_statue * plan.statues.size();
    }
    static constexpr uint64_t least_column = 16, least_pot = 12, least_leaves = 8, least_statue = 12;  // triangles of each, leaves as quads
    uint64_t plants, benches, columns;
    uint64_t least_triangles;  // with everything as coarse as can be
};

class Museum {
public:
    Museum(const MakeSceneOptions& options, const MuseumPlan& plan, SceneWriter& scene)
        : options_(options), plan_(plan), counts_(plan), scene_(scene) {}

    Status write() {
        add_view();
        add_materials();
        add_light();
        RAYPAGER_TRY(add_building());
        RAYPAGER_TRY(add_columns());
        RAYPAGER_TRY(add_furniture());
        RAYPAGER_TRY(add_plants());
        RAYPAGER_TRY(add_paintings());
        return add_statues();
    }

private:
    static constexpr double pedestal_height = 0.9;

    // What is shared out among things that can be finer or coarser: so much of it for each of count of them.
    uint64_t share(double part, uint64_t count, uint64_t least, uint64_t most) const {
        const double free = static_cast<double>(options_.triangles - counts_.least_triangles);
        return std::clamp(least + static_cast<uint64_t>(part * free / static_cast<double>(count)), least, most);
    }
    const std::string& name(uint32_t image) const { return plan_.images[image].name; }

    void add_view() {
        const double x = plan_.half_width(), up = plan_.storeys - 1;
        scene_.begin(
            fmt::format("A museum of {} images, {} bytes of texels, seed {}; metres", plan_.images.size(), options_.texture_bytes, options_.seed),
            {.eye = {0.14 * x, 1.75 + 0.9 * up, 4.4}, .target = {-0.04 * x, 1.9 + 1.5 * up, -14}, .fov_degrees = 52});
    }

    void add_materials() {
        const MuseumBuilding& b = plan_.building;
        const auto scale_of = [&](uint32_t index, const MuseumImage& image) {
            return index == b.floor_roughness ? 0.35 : image.covering == Covering::leaf_mask ? 1 : 0.7;
        };
        for (uint32_t i = 0; i < plan_.images.size(); i++) {
            const MuseumImage& image = plan_.images[i];
            if (image.grey())
                scene_.number_texture(image.name, image.file(), scale_of(i, image));
            else
                scene_.color_texture(image.name, image.file());
        }
        scene_.textured_coat("floor", name(b.floor), name(b.floor_roughness));
        for (const uint32_t i : {b.wall, b.ceiling, b.pedestal, b.pot}) scene_.textured_diffuse(name(i), name(i));
        scene_.textured_coat("column", name(b.column), "0.15");
        scene_.textured_coat("bench", name(b.bench), "0.25");
        add_metal("gilt", b.gilt_roughness, true);
        add_metal("dark", b.dark_roughness, false);
        for (const MuseumPlant& plant : plan_.plants) scene_.textured_diffuse(name(plant.leaf), name(plant.leaf));
        for (size_t i = 0; i < plan_.statues.size(); i++) {
            const MuseumStatue& s = plan_.statues[i];
            if (s.roughness == no_image && i % 3 == 0)
                scene_.textured_diffuse(name(s.stone), name(s.stone));
            else
                scene_.textured_coat(name(s.stone), name(s.stone), s.roughness == no_image ? "0.1" : name(s.roughness));
        }
        for (const MuseumPainting& p : plan_.paintings) {
            if (p.roughness == no_image)
                scene_.textured_diffuse(name(p.picture), name(p.picture));
            else
                scene_.textured_coat(name(p.picture), name(p.picture), name(p.roughness));
            if (p.frame_roughness != no_image) add_metal(name(p.frame_roughness), p.frame_roughness, p.frame_roughness % 2 == 0);
        }
    }

    // Gold, or something like dark bronze.
    void add_metal(std::string_view material, uint32_t roughness, bool gold) {
        if (gold)
            scene_.textured_conductor(material, {0.143, 0.375, 1.442}, {3.983, 2.386, 1.603}, name(roughness));
        else
            scene_.textured_conductor(material, {1.9, 2.2, 2.3}, {1.5, 1.25, 1.05}, name(roughness));
    }

    void add_light() {
        scene_.sky({0.35, 0.4, 0.5});
        const double strength = 1 + 0.1 * (plan_.storeys - 1);  // so that the floor of a high hall is not dark
        const double width = 0.8 * plan_.half_width(), y = plan_.height() - 0.03;
        for (uint32_t bay = 0; bay < plan_.bays; bay++)
            scene_.light({-0.5 * width, y, -MuseumPlan::bay * (bay + 0.8)}, {width, 0, 0}, {0, 0, 0.6 * MuseumPlan::bay},
                         {9.4 * strength, 9.0 * strength, 8.2 * strength});
    }

    Status add_building() {
        const double x = plan_.half_width(), y = plan_.height(), front = entrance, back = -plan_.length(), along = front - back;
        TriangleMesh mesh;
        add_panel(mesh, {-x, 0, front}, {2 * x, 0, 0}, {0, 0, -along}, 2 * x / 3, along / 3);
        RAYPAGER_TRY(scene_.textured_mesh("floor", "floor", mesh));
        mesh = {};
        add_panel(mesh, {x, y, front}, {-2 * x, 0, 0}, {0, 0, -along}, 2 * x / 2.5, along / 2.5);
        RAYPAGER_TRY(scene_.textured_mesh("ceiling", name(plan_.building.ceiling), mesh));
        mesh = {};
        add_panel(mesh, {-x, 0, front}, {0, 0, -along}, {0, y, 0}, along / 2.2, y / 2.2);
        add_panel(mesh, {x, 0, back}, {0, 0, along}, {0, y, 0}, along / 2.2, y / 2.2);
        add_panel(mesh, {-x, 0, back}, {2 * x, 0, 0}, {0, y, 0}, 2 * x / 2.2, y / 2.2);
        RAYPAGER_TRY(scene_.textured_mesh("walls", name(plan_.building.wall), mesh));
        // A ledge over each storey, and flat pillars beside the upper ones.
        mesh = {};
        for (uint32_t storey = 0; storey < plan_.storeys; storey++)
            for (const double side : {-1.0, 1.0}) {
                add_block(mesh, {{side * (x - 0.15), MuseumPlan::storey * (storey + 1) - 0.16, 0.5 * (front + back)}}, 0.3, 0.16, along);
                for (uint32_t pillar = 0; pillar <= plan_.bays && storey > 0; pillar++)
                    add_block(mesh, {{side * (x - 0.08), MuseumPlan::storey * storey, -MuseumPlan::bay * pillar}}, 0.16, MuseumPlan::storey - 0.16,
                              0.5);
            }
        return scene_.textured_mesh("ledges", name(plan_.building.pedestal), mesh);
    }

    Status add_columns() {
        TriangleMesh mesh;
        const uint64_t triangles = share(0.15, counts_.columns, MuseumCounts::least_column, 3000);
        for (uint32_t i = 0; i < counts_.columns; i++) {
            const double side = i % 2 == 0 ? -1 : 1;
            const uint32_t bay = i / 2;
            add_grid(mesh, column_grid({side * (plan_.half_width() - 0.28), 0, -MuseumPlan::bay * bay}, 0.17, MuseumPlan::storey - 0.16, triangles));
        }
        return scene_.textured_mesh("columns", "column", mesh);
    }

    // One of so many places for each of fewer things: evenly spread, and on both sides of the hall if there are enough.
    static size_t spread(size_t i, size_t things, size_t places) {
        const size_t place = i * places / things, other_side = place ^ (i & 1);
        return places >= 2 * things && other_side < places ? other_side : place;
    }
    uint32_t statue_site(size_t i) const { return static_cast<uint32_t>(spread(i, plan_.statues.size(), plan_.sites())); }

    Status add_furniture() {
        TriangleMesh pedestals, benches;
        for (size_t i = 0; i < plan_.statues.size(); i++) add_block(pedestals, {plan_.site(statue_site(i))}, 0.7, pedestal_height, 0.7);
        RAYPAGER_TRY(scene_.textured_mesh("pedestals", name(plan_.building.pedestal), pedestals));
        for (uint64_t i = 0; i < counts_.benches; i++) {
            const Pose at = {{0, 0, -MuseumPlan::bay * (2 * static_cast<double>(i) + 0.7)}};
            for (const double end : {-0.85, 0.85}) add_block(benches, at.moved(0, 0, end), 0.45, 0.4, 0.1);
            add_block(benches, at.moved(0, 0.4, 0), 0.55, 0.07, 2.1);
        }
        return scene_.textured_mesh("benches", "bench", benches);
    }

    // Sites without a statue, evenly; where there are not enough, plants stand along the middle.
    std::vector<Vector> plant_sites() const {
        std::vector<bool> taken(plan_.sites());
        for (size_t i = 0; i < plan_.statues.size(); i++) taken[statue_site(i)] = true;
        std::vector<Vector> free, sites;
        for (uint32_t i = 0; i < plan_.sites(); i++)
            if (!taken[i]) free.push_back(plan_.site(i));
        for (uint64_t i = 0; i < counts_.plants; i++)
            sites.push_back(free.size() >= counts_.plants
                                ? free[spread(i, counts_.plants, free.size())]
                                : Vector{1.2, 0, -plan_.length() * (static_cast<double>(i) + 0.5) / static_cast<double>(counts_.plants)});
        return sites;
    }

    Status add_plants() {
        Random random(options_.seed, 40);
        const uint64_t for_pot = share(0.05, counts_.plants, MuseumCounts::least_pot, 2000),
                       for_leaves = share(0.2, counts_.plants, 2 * MuseumCounts::least_leaves, 3000) / 2;
        const auto leaves = static_cast<uint32_t>(std::clamp<uint64_t>(for_leaves / 6, MuseumCounts::least_leaves, 60));
        const auto segments = static_cast<uint32_t>(std::max<uint64_t>(1, for_leaves / leaves));
        TriangleMesh pots;
        std::vector<TriangleMesh> kinds(plan_.plants.size());
        size_t kind = 0;
        for (const Vector& site : plant_sites()) {
            const double size = random.uniform(0.75, 1.25);
            add_grid(pots, pot_grid(site, 0.28 * size, 0.5 * size, for_pot));
            add_leaves(kinds[kind++ % kinds.size()], site + Vector{0, 0.42 * size, 0}, 1.15 * size, leaves, segments, random);
        }
        RAYPAGER_TRY(scene_.textured_mesh("pots", name(plan_.building.pot), pots));
        for (size_t i = 0; i < kinds.size(); i++) {
            const MuseumPlant& plant = plan_.plants[i];
            RAYPAGER_TRY(scene_.textured_mesh(name(plant.leaf), name(plant.leaf), kinds[i], name(plant.mask)));
        }
        return {};
    }

    Status add_paintings() {
        const bool fine =
            (frame_triangles(true) - frame_triangles(false)) * plan_.paintings.size() < (options_.triangles - counts_.least_triangles) / 5;
        TriangleMesh gilt, dark;
        for (size_t i = 0; i < plan_.paintings.size(); i++) {
            const MuseumPainting& p = plan_.paintings[i];
            TriangleMesh canvas, frame;
            add_panel(canvas, p.corner.at(0, 0, 0.02), p.corner.x * p.width, p.corner.y * p.height);
            RAYPAGER_TRY(scene_.textured_mesh(name(p.picture), name(p.picture), canvas));
            add_frame(frame, p.corner, p.width, p.height, fine);
            if (p.frame_roughness != no_image)
                RAYPAGER_TRY(scene_.textured_mesh(name(p.frame_roughness), name(p.frame_roughness), frame));
            else
                append_mesh(i % 4 == 1 ? dark : gilt, frame);
        }
        if (!gilt.triangles.empty()) RAYPAGER_TRY(scene_.textured_mesh("frames-gilt", "gilt", gilt));
        if (!dark.triangles.empty()) RAYPAGER_TRY(scene_.textured_mesh("frames-dark", "dark", dark));
        return {};
    }

    // They take all triangles that are left.
    Status add_statues() {
        Random random(options_.seed, 41);
        for (size_t i = 0; i < plan_.statues.size(); i++) {
            const uint64_t left = options_.triangles - std::min(options_.triangles, scene_.triangles());
            const std::string& stone = name(plan_.statues[i].stone);
            const double height = random.uniform(1.0, 1.5);
            const uint64_t seed = random.bits();
            const UvGrid grid =
                statue_grid(plan_.site(statue_site(i)) + Vector{0, pedestal_height, 0}, height, left / (plan_.statues.size() - i), seed);
            RAYPAGER_TRY(write_grid(scene_, stone, stone, grid));
        }
        return {};
    }

    const MakeSceneOptions& options_;
    const MuseumPlan& plan_;
    const MuseumCounts counts_;
    SceneWriter& scene_;
};

}  // namespace

Result<MadeScene> make_museum(const MakeSceneOptions& options) {
    MuseumPlan plan = plan_museum(options.textures, options.seed);
    RAYPAGER_TRY(size_images(plan.images, options.texture_bytes));
    const uint64_t least = MuseumCounts(plan).least_triangles;
    if (options.triangles < least)
        return Status::usage(fmt::format("a museum of {} textures has at least {} triangles, not {}", options.textures, least, options.triangles));
    auto scene = SceneWriter::create(options);
    if (!scene) return scene.status();
    RAYPAGER_TRY(write_images(plan, options, *scene));
    RAYPAGER_TRY(Museum(options, plan, *scene).write());
    return scene->finish();
}

}  // namespace raypager
