// The log of blocks that rays enter (abi/visits.h).
#pragma once

#include <cstdint>

#include "raypager/abi/visits.h"

namespace raypager {

// What is recorded of the blocks that rays enter (abi/visits.h). By default nothing, and then it costs nothing.
struct VisitLogSettings {
    uint32_t capacity = 0;    // events a round; rays that find no room wait for the next one. 0: nothing is recorded
    uint32_t threshold = 0;   // RP_VISIT_THRESHOLD: 2^32 - 1 records all paths
    uint64_t bytes() const {  // on the device
        return capacity ? (RP_VISIT_HEADER + uint64_t{RP_VISIT_WORDS} * capacity) * sizeof(uint32_t) : 0;
    }
};

}  // namespace raypager
