// The options that say what becomes of point clouds when they are baked.
#pragma once

#include "cli/option_parser.hpp"
#include "raypager/bake.hpp"

namespace raypager {

void add_point_options(OptionParser& parser, PointOptions& options);
// Whether any of them was given a value other than its default.
bool changes_points(const PointOptions& options);

}  // namespace raypager
