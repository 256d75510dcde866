// Coverage-guided fuzzing (libFuzzer): what a target supplies, and what it gets. A target is one .cpp file in this folder that defines
// seeds() and run(); CMake makes the program fuzz_NAME of NAME.cpp. Start it with a folder for its corpus; an empty one is filled with
// the seeds first, so that no corpus lies in the repository.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace raypager::fuzz {

// Defined by each target: well-formed inputs to start from, and one try. A find is whatever the sanitizers, RAYPAGER_CHECK, or
// libFuzzer's limits on time and memory stop.
std::vector<std::string> seeds();
void run(std::string_view input);

// Puts content into a file of this name, in memory where the system has a file system for that, and returns its path.
std::filesystem::path write_input(const std::string& name, std::string_view content);
// A file of that folder that exists for as long as the program.
std::filesystem::path scratch_path(const std::string& name);
// Stops the program if bytes, which an input made it take, are out of proportion to it: more than factor times as many, and a megabyte.
void check_proportion(uint64_t bytes, std::string_view input, uint64_t factor);

}  // namespace raypager::fuzz
