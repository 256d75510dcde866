// Counters of one round, read back after it (abi/path.h).
#pragma once

#include <array>
#include <cstdint>

#include "raypager/abi/path.h"

namespace raypager {

struct RoundCounters {
    std::array<uint32_t, RP_COUNTER_WORDS> words{};
    uint32_t extend_rays() const { return words[RP_COUNT_EXTEND]; }
    uint32_t shadow_rays() const { return words[RP_COUNT_SHADOW]; }
    uint32_t textured_slots() const { return words[RP_COUNT_TEXTURED]; }  // whose page has come
    uint32_t free_slots() const { return words[RP_COUNT_FREE]; }
    uint32_t idle_slots() const { return words[RP_COUNT_IDLE]; }
    uint32_t waiting_rays() const { return words[RP_COUNT_WAITING]; }
    uint64_t samples_begun() const { return counter64(RP_COUNT_SAMPLES); }
    uint64_t camera_rays() const { return counter64(RP_COUNT_CAMERA_RAYS); }
    uint64_t bounce_rays() const { return counter64(RP_COUNT_BOUNCE_RAYS); }
    uint64_t total_shadow_rays() const { return counter64(RP_COUNT_SHADOW_RAYS); }
    uint64_t requests_served() const { return counter64(RP_COUNT_REQUESTS_SERVED); }
    uint64_t requests_without_hit() const { return counter64(RP_COUNT_REQUESTS_NO_HIT); }

private:
    uint64_t counter64(uint32_t at) const { return words[at] | static_cast<uint64_t>(words[at + 1]) << 32; }
};

}  // namespace raypager
