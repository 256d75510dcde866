// Kernels built by other processes. Compilers of some drivers (NVIDIA's) take one program at a time in a process, however many threads ask: a first
// render, for which nothing is in the cache on disk, then waits for seven programs in a row. In processes of their own they are built side by side.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "raypager/status.hpp"

namespace raypager {

// command: starts a program that calls build_kernels() with the arguments that are appended to it, and does nothing else. The program `raypager`
// names itself. Each process opens the device for a second or so, for which a driver takes some hundred MB of its memory. Without one, or where such
// a process fails, this process builds its kernels itself. Before the first device is opened.
void set_kernel_builder(std::vector<std::string> command);

// Builds what the arguments say, and leaves it in the cache of kernels (src/device/program_cache.hpp). Fails if the device is not there, or the
// kernels do not build.
Status build_kernels(std::span<const std::string> arguments);

}  // namespace raypager
