// How much main memory there is to take.
#pragma once

#include <cstdint>

namespace raypager {

// Bytes that are free now, and within the limit of this process's control group (containers); 1 GiB if the system does not tell.
uint64_t available_memory();

}  // namespace raypager
