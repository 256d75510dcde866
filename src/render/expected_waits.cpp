#include "render/expected_waits.hpp"

#include <algorithm>

namespace raypager {

// Paths go through their slots in waves. In a wave a path waits one time after the other, once for every other ray where nothing is resident; a wait
// is a round or two. Measured: 0.25 to 1 ms a wait on two cores (3 M triangles in 887 blocks, 64 and 1024 slots, 2 % resident), 0.8 and 1.0 ms on an
// H200 (250 M triangles, 0.26 and 1 M slots, 13 %). The sweep loads what lies between one block that is waited for and the next.
ExpectedSeconds expected_seconds(const WaitNeeds& needs) {
    constexpr double wait_seconds = 0.0005, waits_per_slot = 0.3, rays_per_path = 4, blocks_per_ray = 2;
    constexpr uint32_t typical_depth = 5;
    const double slots = static_cast<double>(std::max<uint64_t>(needs.slots, 1)), paths = static_cast<double>(needs.paths);
    const double rays = std::min(needs.max_depth, typical_depth) + 1, absent = 1 - std::clamp(needs.resident_share, 0.0, 1.0);
    const double waits = std::max(1.0, paths / slots) * rays * blocks_per_ray * absent;
    const double between = needs.sweeps ? static_cast<double>(needs.blocks) / (1 + waits_per_slot * slots) : 0;
    return {paths * rays_per_path / needs.rays_per_second, waits * (wait_seconds + between / needs.loads_per_second)};
}

bool crawls(const ExpectedSeconds& seconds) {
    constexpr double too_many_times = 10, patience = 10;
    return seconds.waiting > too_many_times * seconds.tracing && seconds.waiting > patience;
}

}  // namespace raypager
