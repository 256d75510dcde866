#include "procedural/make_scene.hpp"

#include <fmt/format.h>

#include "procedural/kinds.hpp"
#include "procedural/museum_plan.hpp"

namespace raypager {
namespace {

constexpr uint64_t min_triangles = 1000, max_triangles = 4'000'000'000;
constexpr uint64_t min_points = 1000, max_points = 4'000'000'000, default_points = 10'000'000;
constexpr uint64_t default_triangles = 10'000'000;
constexpr uint64_t default_cornell_triangles = 45'000'000;  // about 1 GB of geometry
constexpr uint64_t default_forest_triangles = 5'000'000, default_island_triangles = 20'000'000, default_instances = 1'000'000,
                   max_instances = 1'000'000'000;
constexpr uint64_t max_copies = 1000;
constexpr uint64_t moana_triangles = 522'000'000, moana_instances = 39'300'000;
constexpr uint64_t default_museum_triangles = 200'000, default_textures = 300, default_texture_bytes = 1 << 20;  // of each

bool has_instances(const MakeSceneOptions& options) { return options.kind == "forest" || options.kind == "island"; }

Result<MadeScene> make_with_instances(MakeSceneOptions options) {
    const bool island = options.kind == "island";
    if (options.instances == 0) options.instances = default_instances;
    if (options.instances > max_instances)
        return Status::usage(fmt::format("{} {} of {} instances cannot be made; ask for 1 to {}", island ? "an" : "a", options.kind,
                                         options.instances, max_instances));
    if (options.triangles == 0) options.triangles = island ? default_island_triangles : default_forest_triangles;
    if (options.copies == 0) options.copies = 1;
    if (options.copies > max_copies)
        return Status::usage(fmt::format("{} copies of an island cannot be made; ask for 1 to {}", options.copies, max_copies));
    return island ? make_island(options) : make_forest(options);
}

}  // namespace

Status apply_preset(std::string_view preset, MakeSceneOptions& options) {
    if (preset != "moana") return Status::usage(fmt::format("unknown preset \"{}\"; there is moana", preset));
    if (options.triangles == 0) options.triangles = moana_triangles;
    if (options.instances == 0) options.instances = moana_instances;
    return {};
}

Result<MadeScene> make_scene(const MakeSceneOptions& wanted) {
    MakeSceneOptions options = wanted;
    if (options.triangles != 0 && (options.triangles < min_triangles || options.triangles > max_triangles))
        return Status::usage(
            fmt::format("a scene of {} triangles cannot be made; ask for {} to {}", options.triangles, min_triangles, max_triangles));
    if (options.kind != "museum" && (options.textures != 0 || options.texture_bytes != 0))
        return Status::usage(fmt::format("only a museum has textures; a scene of the kind \"{}\" has none", options.kind));
    if (!has_instances(options) && options.instances != 0)
        return Status::usage(fmt::format("only a forest or an island has instances; a scene of the kind \"{}\" has none", options.kind));
    if (options.kind != "island" && options.copies != 0)
        return Status::usage(fmt::format("only an island has copies; a scene of the kind \"{}\" has none", options.kind));
    if (options.kind == "points") {
        if (options.triangles != 0 || options.heightmap) return Status::usage("a scene of points has no triangles and no height map");
        if (options.points == 0) options.points = default_points;
        if (options.points < min_points || options.points > max_points)
            return Status::usage(fmt::format("a scene of {} points cannot be made; ask for {} to {}", options.points, min_points, max_points));
        return make_points(options);
    }
    if (options.points != 0) return Status::usage(fmt::format("a {} has no points", options.kind));
    if (options.heightmap && options.kind != "terrain") return Status::usage(fmt::format("a height map makes a terrain, not a {}", options.kind));
    if (options.kind == "terrain") {
        if (options.triangles == 0 && !options.heightmap) options.triangles = default_triangles;
        return make_terrain(options);
    }
    if (options.kind == "museum") {
        if (options.textures == 0) options.textures = default_textures;
        if (options.textures < min_museum_textures || options.textures > max_museum_textures)
            return Status::usage(
                fmt::format("a museum of {} textures cannot be made; ask for {} to {}", options.textures, min_museum_textures, max_museum_textures));
        if (options.texture_bytes == 0) options.texture_bytes = default_texture_bytes * options.textures;
        // A large one needs more for its frames alone.
        if (options.triangles == 0) options.triangles = default_museum_triangles + 100 * options.textures;
        return make_museum(options);
    }
    if (has_instances(options)) return make_with_instances(options);
    if (options.triangles == 0) options.triangles = options.kind == "cornell" ? default_cornell_triangles : default_triangles;
    if (options.kind == "cornell") return make_cornell(options);
    if (options.kind == "clutter") return make_clutter(options);
    return Status::usage(
        fmt::format("unknown kind of scene \"{}\"; there are cornell, terrain, clutter, points, museum, forest and island", options.kind));
}

}  // namespace raypager
