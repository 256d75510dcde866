// The measurements of the verb `bench`, one file each.
#pragma once

#include "cli/option_parser.hpp"
#include "raypager/status.hpp"

namespace raypager {

Status run_bench_export(const Arguments& arguments);
Status run_bench_traverse(const Arguments& arguments);
Status run_bench_policy(const Arguments& arguments);
Status run_bench_cluster(const Arguments& arguments);
Status run_bench_sweep(const Arguments& arguments);

}  // namespace raypager
