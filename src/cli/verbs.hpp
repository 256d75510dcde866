// The verbs of the program, one file each. A verb prints its results itself and returns what went wrong.
#pragma once

#include "cli/option_parser.hpp"
#include "raypager/status.hpp"

namespace raypager {

Status run_devices(const Arguments& arguments);
Status run_make_scene(const Arguments& arguments);
Status run_bake(const Arguments& arguments);
Status run_inspect(const Arguments& arguments);
Status run_render(const Arguments& arguments);
Status run_compare(const Arguments& arguments);
Status run_bench(const Arguments& arguments);

}  // namespace raypager
