#include "procedural/make_scene.hpp"

#include <fmt/format.h>

#include <cstdio>

#include "base/log.hpp"
#include "cli/values.hpp"
#include "cli/verbs.hpp"

namespace raypager {
namespace {

constexpr const char* about_make_scene =
    "Writes a procedural scene: DIR/scene.pbrt and its meshes or points. The same seed gives the same scene. KIND is one of\n"
    "  cornell   a Cornell box with three complex models (default: about 1 GB)\n"
    "  terrain   a fractal landscape, or one from an elevation image\n"
    "  clutter   thousands of small parts, unevenly dense, with overlapping bounds\n"
    "  points    a city under an airborne laser scanner: points with colours, classes\n"
    "  museum    a hall of pictures whose textures, not geometry, outgrow memory\n"
    "  forest    trees, rocks and grass as instances, any number of them\n"
    "  island    a tropical island of instances, or an archipelago of copies of it";

constexpr uint64_t max_primitives = 4000000000;  // they are numbered in 32 bits

Result<PointFormat> parse_point_format(const std::string& text) {
    if (text == "las") return PointFormat::las;
    if (text == "ply") return PointFormat::ply;
    return Status::usage(fmt::format("'{}' is not a format of points; use las or ply", text));
}

Result<std::string> parse_preset(const std::string& text) {
    if (text == "moana") return text;
    return Status::usage(fmt::format("'{}' is not a preset; use moana", text));
}

Status check_kind(const OptionParser& parser, const MakeSceneOptions& options, const std::string& preset) {
    if (options.kind != "cornell" && options.kind != "terrain" && options.kind != "clutter" && options.kind != "points" && options.kind != "museum" &&
        options.kind != "forest" && options.kind != "island")
        return parser.wrong(
            fmt::format("'{}' is not a kind of scene; use cornell, terrain, clutter, points, museum, forest or island", options.kind));
    if (options.heightmap && options.kind != "terrain") return parser.wrong("--heightmap: is for terrain only; leave it out");
    if (options.triangles && options.kind == "points") return parser.wrong("--triangles: there are none in points; use --points");
    if (options.points && options.kind != "points")
        return parser.wrong(fmt::format("--points: is for points only; {} takes --triangles", options.kind));
    if (options.kind != "museum" && (options.textures || options.texture_bytes))
        return parser.wrong(fmt::format("{}: is for museum only; leave it out", options.textures ? "--textures" : "--texture-bytes"));
    if (options.instances && options.kind != "forest" && options.kind != "island")
        return parser.wrong("--instances: is for forest and island only; leave it out");
    if (options.copies && options.kind != "island") return parser.wrong("--copies: is for island only; leave it out");
    if (!preset.empty() && options.kind != "island") return parser.wrong("--preset: is for island only; leave it out");
    if (options.directory.empty()) return parser.wrong("-o is missing; name the directory to write to");
    return {};
}

}  // namespace

Status run_make_scene(const Arguments& arguments) {
    MakeSceneOptions options;
    std::vector<std::string> kinds;
    std::filesystem::path heightmap;
    std::string preset;
    OptionParser parser("make-scene", "KIND -o DIR [options]", about_make_scene);
    parser.inputs("the kind of scene", 1, 1, kinds);
    parser.option("output,o", "DIR", "directory to write to; made if absent", into_path(options.directory));
    parser.option("triangles", "N", "about how many triangles, 1K to 4G (default: the kind's own)",
                  into(options.triangles, [](const std::string& text) { return parse_count(text, 1000, max_primitives); }));
    parser.option("points", "N", "points only: about how many, 1K to 4G (default: 10M)",
                  into(options.points, [](const std::string& text) { return parse_count(text, 1000, max_primitives); }));
    parser.option("format", "NAME", "points only: las (LAS 1.4) or ply (default: las)", into(options.format, parse_point_format));
    parser.option("textures", "N", "museum only: how many images, 16 to 20K (default: 300)",
                  into(options.textures, [](const std::string& text) { return parse_count(text, 16, 20000); }));
    parser.option("texture-bytes", "SIZE", "museum only: what all images take together, decoded (default: 1 MiB each)",
                  into(options.texture_bytes, [](const std::string& text) { return parse_size(text); }));
    parser.option("instances", "N", "forest, island: how many, 1 to 1G (default: 1M); --triangles are those that they share",
                  into(options.instances, [](const std::string& text) { return parse_count(text, 1, 1000000000); }));
    parser.option("preset", "NAME", "island only: moana, 522M triangles and 39.3M instances", into(preset, parse_preset));
    parser.option("copies", "N", "island only: places the whole island, 1 to 1000 times (default: 1)",
                  into(options.copies, [](const std::string& text) { return parse_count(text, 1, 1000); }));
    parser.option("seed", "S", "seed of the random numbers, 0 to 2^32 - 1 (default: 1)",
                  into(options.seed, [](const std::string& text) { return parse_count(text, 0, 0xffffffffu); }));
    parser.option("heightmap", "IMAGE", "terrain only: elevations from the pixels of an image", into_path(heightmap));
    const auto outcome = parser.parse(arguments);
    if (!outcome) return outcome.status();
    if (*outcome == OptionParser::Outcome::help_shown) return {};
    options.kind = kinds.front();
    if (!heightmap.empty()) options.heightmap = heightmap;
    RAYPAGER_TRY(check_kind(parser, options, preset));
    if (!preset.empty()) RAYPAGER_TRY(apply_preset(preset, options));

    int shown = -1;
    options.progress = [&](double share) {
        const int percent = static_cast<int>(100 * share);
        if (percent != shown && stderr_is_terminal()) progress_line(fmt::format("make-scene: images {} %", shown = percent));
    };
    const auto made = make_scene(options);
    progress_line("");
    if (!made) return made.status();
    const bool points = made->points > 0;
    const std::string primitives = points ? counted(made->points, "point") : counted(made->triangles, "triangle");
    const std::string textures =
        made->textures == 0 ? "" : fmt::format(", {} of {}", counted(made->textures, "texture"), format_bytes(made->texture_bytes));
    const std::string instances = made->instances == 0 ? "" : fmt::format(" in {}", counted(made->instances, "instance"));
    std::fputs(fmt::format("{}: {}{}{}, {}\n", made->scene_file.string(), primitives, instances, textures, format_bytes(made->bytes)).c_str(),
               stdout);
    return {};
}

}  // namespace raypager
