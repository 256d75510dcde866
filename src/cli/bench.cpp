#include "cli/bench.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <iterator>
#include <string>

#include "cli/verbs.hpp"

namespace raypager {
namespace {

constexpr Verb measurements[] = {
    {"export", "writes a baked scene for Mitsuba 3, to compare with it", run_bench_export},
    {"traverse", "rays per second of the engine's own kernels on a baked scene", run_bench_traverse},
    {"sweep", "renders at many limits, policies and path counts: tables, curves", run_bench_sweep},
    {"policy", "replays a recorded demand trace under other policies and limits", run_bench_policy},
    {"cluster", "simulates clusters on a recorded demand trace: efficiency, links", run_bench_cluster},
};

std::string usage() {
    std::string text =
        "Usage: raypager bench MEASUREMENT ...\n\nMeasures the program itself. 'raypager help bench MEASUREMENT' shows the options\nof "
        "one.\n\nMeasurements:\n";
    for (const Verb& m : measurements) text += fmt::format("  {:<10} {}\n", m.name, m.about);
    return text;
}

}  // namespace

std::span<const Verb> bench_measurements() { return measurements; }

Status run_bench(const Arguments& arguments) {
    if (arguments.empty()) return Status::usage("bench: the measurement is missing; see 'raypager help bench'");
    if (arguments.front() == "--help" || arguments.front() == "-h") {
        std::fputs(usage().c_str(), stdout);
        return {};
    }
    const auto* found = std::find_if(std::begin(measurements), std::end(measurements), [&](const Verb& m) { return arguments.front() == m.name; });
    if (found == std::end(measurements))
        return Status::usage(fmt::format("bench: '{}' is not a measurement; see 'raypager help bench'", arguments.front()));
    return found->run(Arguments(arguments.begin() + 1, arguments.end()));
}

}  // namespace raypager
