#include <fmt/format.h>

#include <cstdio>

#include "base/log.hpp"
#include "bench/export.hpp"
#include "cli/bench.hpp"
#include "cli/values.hpp"

namespace raypager {
namespace {

constexpr const char* about_export =
    "Writes a baked scene for Mitsuba 3: DIR/scene.xml and its meshes. Camera, materials, lights, depth, roulette and pixel filter are\n"
    "the same. bench/mitsuba/compare.py renders with both and compares their times.";

}  // namespace

Status run_bench_export(const Arguments& arguments) {
    std::vector<std::string> inputs;
    std::filesystem::path directory;
    OptionParser parser("bench export", "FILE.rpb -o DIR", about_export);
    parser.inputs("the block file", 1, 1, inputs);
    parser.option("output,o", "DIR", "directory to write to; made if absent", into_path(directory));
    const auto outcome = parser.parse(arguments);
    if (!outcome) return outcome.status();
    if (*outcome == OptionParser::Outcome::help_shown) return {};
    if (directory.empty()) return parser.wrong("-o is missing; name the directory to write to");
    const auto file = BlockFile::open(inputs.front());
    if (!file) return file.status();
    int shown = -1;
    const auto made = bench::export_to_mitsuba(**file, directory, [&](double fraction) {
        const int percent = static_cast<int>(fraction * 100);
        if (percent != shown && stderr_is_terminal()) progress_line(fmt::format("export: {} %", shown = percent));
    });
    progress_line("");
    if (!made) return made.status();
    std::fputs(fmt::format("{}: {}, {}, {}\n", (directory / "scene.xml").string(), counted(made->triangles, "triangle"),
                           counted(made->spheres, "sphere"), format_bytes(made->bytes))
                   .c_str(),
               stdout);
    return {};
}

}  // namespace raypager
