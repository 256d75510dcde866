// How much main memory there is to take.
#pragma once

#include <cstdint>

namespace raypager {

// Bytes that are free now, and within the limit of this process's control group (containers); 1 GiB if the system does not tell.
uint64_t available_memory();

// Main memory that this process occupies (resident set), and the most that it ever did; 0 if the system does not tell.
uint64_t process_memory();
uint64_t peak_process_memory();

}  // namespace raypager
