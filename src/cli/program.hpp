// The whole program, from the arguments behind its name to its exit status.
#pragma once

#include "cli/option_parser.hpp"

namespace raypager {

// Not for users: how the program starts itself to build kernels (raypager/kernel_builder.hpp).
inline constexpr const char* kernel_builder_verb = "build-kernels";

// 0: done; 1: the work failed; 2: bad usage. An error is one line on stderr. Throws nothing.
int run_program(const Arguments& arguments) noexcept;

}  // namespace raypager
