// What measurements of the tracing stages are asked to trace: 'raypager bench traverse' and raypager-embree.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "bench/traverse.hpp"
#include "cli/option_parser.hpp"
#include "cli/values.hpp"
#include "raypager/camera_text.hpp"

namespace raypager {

struct TraverseSettings {
    std::vector<std::string> inputs;
    bench::TraverseOptions options;  // as given; size and camera are filled in by traverse_options
    std::optional<CameraText> camera;
    ImageSize size{options.width, options.height};
};

// The block file, and options for rays and repeats.
void add_traverse_options(OptionParser& parser, TraverseSettings& settings);
bench::TraverseOptions traverse_options(const TraverseSettings& settings);

}  // namespace raypager
