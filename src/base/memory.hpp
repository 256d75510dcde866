// How much main memory there is to take.
#pragma once

#include <cstdint>

namespace raypager {

// Bytes that are free now, and within the limit of this process's control group (containers); 1 GiB if the system does not tell.
uint64_t available_memory();

// Bytes that there are in all, within the same limit.
uint64_t total_memory();

// A limit that nobody gave. `usual` follows from the machine alone, so that the same command does the same tomorrow; only where less than that is
// free at the moment it is seven eighths of what is.
struct DefaultLimit {
    uint64_t bytes = 0, usual = 0;
    bool reduced() const { return bytes < usual; }
};
DefaultLimit default_limit(uint64_t usual, uint64_t available);

// Main memory that this process occupies (resident set), and the most that it ever did; 0 if the system does not tell.
uint64_t process_memory();
uint64_t peak_process_memory();

}  // namespace raypager
