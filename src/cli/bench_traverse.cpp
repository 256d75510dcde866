#include "cli/bench.hpp"

namespace raypager {

Status run_bench_traverse(const Arguments&) { return Status::failed("bench traverse: comes with the next change"); }

}  // namespace raypager
