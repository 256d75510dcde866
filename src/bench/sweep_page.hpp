// The page that a sweep writes: one HTML file with its plots inside, which needs neither network nor script and can be printed.
#pragma once

#include <string>

#include "bench/sweep.hpp"

namespace raypager::bench {

struct SweepPageFacts {
    std::string scene;    // the input's name
    std::string command;  // how the sweep was started
    std::string date;
    std::string primitives;  // "45,012,345 triangles in 1,037 blocks, 925 MiB"
    uint32_t block_count = 0;
};

std::string sweep_page(const SweepResult& result, const SweepPageFacts& facts);

}  // namespace raypager::bench
