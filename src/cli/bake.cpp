#include "raypager/bake.hpp"

#include <fmt/format.h>

#include <limits>

#include "base/log.hpp"
#include "cli/baking.hpp"
#include "cli/look_options.hpp"
#include "cli/output_paths.hpp"
#include "cli/point_options.hpp"
#include "cli/stop_signal.hpp"
#include "cli/values.hpp"
#include "cli/verbs.hpp"
#include "cli/view.hpp"
#include "raypager/abi/block.h"

namespace raypager {
namespace {

constexpr uint64_t smallest_block = uint64_t{16} << 10;

Result<uint64_t> parse_block_size(const std::string& text) {
    const auto bytes = parse_size(text);
    if (bytes && (*bytes < smallest_block || *bytes > RP_MAX_BLOCK_BYTES))
        return Status::usage(fmt::format("'{}' is not between 16K and {}", text, format_bytes(RP_MAX_BLOCK_BYTES)));
    return bytes;
}

Result<float> parse_position_error(const std::string& text) {
    const auto error = parse_positive(text);
    if (!error) return error.status();
    const auto rounded = static_cast<float>(*error);
    if (rounded < min_position_error || rounded > max_position_error)
        return Status::usage(fmt::format("'{}' is not between {} and {}", text, min_position_error, max_position_error));
    return rounded;
}

}  // namespace

Status run_bake(const Arguments& arguments) {
    std::vector<std::string> names;
    std::filesystem::path output;
    BakeOptions options;
    View view;
    BareLook look;
    LookTexts texts;  // only reports need them
    bool progress = false;
    OptionParser parser("bake", "INPUT... -o FILE.rpb [options]",
                        "Cuts a scene into blocks, builds their hierarchies and writes a block file that 'raypager render' takes. INPUT is one\n"
                        ".pbrt, .gltf or .glb scene, or any number of meshes (.ply .obj .stl .off) and point clouds (.las .ply .xyz .pts .txt .asc "
                        ".csv), also packed (.gz), which\n"
                        "are framed, lit and given a ground.");
    parser.inputs("INPUT", 1, std::numeric_limits<size_t>::max(), names);
    parser.option("output,o", "FILE.rpb", "the block file to write", into_path(output));
    parser.option("block-size", "SIZE", "bytes per block at most, in device memory: 16K to 32M (default: for about a thousand blocks, 128K to 4M)",
                  into(options.block_bytes, parse_block_size));
    add_view_options(parser, view.width, view.height, view.camera);
    add_look_options(parser, look, texts);
    add_point_options(parser, options.points);
    parser.option("position-error", "E",
                  "vertices of meshes (not spheres and points) may move by E along each axis, in the scene's units, onto a grid that all share, "
                  "without cracks: fewer bytes per triangle, slower to trace on GPUs (default: they stay where they are, to the bit)",
                  into(options.position_error, parse_position_error));
    parser.option("sub-boxes", "N",
                  "boxes per block at most that say in the top tree where its geometry is, so that fewer rays ask for it: 1 to 64 (default: 64)",
                  into_count(options.block_entries, 1, RP_MAX_BLOCK_ENTRIES));
    parser.option("host-limit", "SIZE",
                  "main memory for the work, besides the program itself; what does not fit goes over the disk, beside FILE.rpb (default: half of "
                  "what there is, or less if less is free)",
                  into(options.host_limit, parse_size));
    parser.flag("progress", "show progress even if stderr is not a terminal", progress);
    const auto outcome = parser.parse(arguments);
    if (!outcome) return outcome.status();
    if (*outcome == OptionParser::Outcome::help_shown) return {};
    if (output.empty()) return parser.wrong("-o is missing; name the block file to write");
    if (!has_ending(output, ".rpb")) return parser.wrong(fmt::format("-o: '{}' does not end in .rpb", output.string()));
    const std::vector<std::filesystem::path> inputs(names.begin(), names.end());
    for (const auto& input : inputs)
        if (has_ending(input, ".rpb")) return parser.wrong(fmt::format("'{}' is baked already; render it", input.string()));
    RAYPAGER_TRY(check_output_path(output));

    RAYPAGER_TRY(check_look_options(parser, look, inputs));
    look.width = view.width;
    look.height = view.height;
    const StopSignal signal(StopMode::leave);
    auto scene = import_with_warnings(inputs, options.host_limit, look, options.points.columns);
    if (!scene) return scene.status();
    RAYPAGER_TRY(set_view(view, *scene));
    return bake_with_notes(*scene, options, output, progress || stderr_is_terminal()).status();
}

}  // namespace raypager
