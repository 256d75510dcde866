// The verbs of the program, one file each. A verb prints its results itself and returns what went wrong.
#pragma once

#include <span>
#include <string_view>

#include "cli/option_parser.hpp"
#include "raypager/status.hpp"

namespace raypager {

Status run_devices(const Arguments& arguments);
Status run_make_scene(const Arguments& arguments);
Status run_bake(const Arguments& arguments);
Status run_inspect(const Arguments& arguments);
Status run_render(const Arguments& arguments);
Status run_view(const Arguments& arguments);
Status run_plan(const Arguments& arguments);
Status run_compare(const Arguments& arguments);
Status run_bench(const Arguments& arguments);
Status run_generate(const Arguments& arguments);

struct Verb {
    std::string_view name, about;
    Status (*run)(const Arguments& arguments);
};

// In the order in which the help lists them.
std::span<const Verb> all_verbs();
std::span<const Verb> bench_measurements();

}  // namespace raypager
