// What waiting for blocks is expected to cost, before anything is rendered: rough, but enough to tell a render that pages from one that crawls.
// 'raypager plan' (bench/) measures it. Pure arithmetic.
#pragma once

#include <cstdint>

namespace raypager {

struct WaitNeeds {
    uint64_t paths = 0;  // that are to be traced
    uint64_t slots = 1;
    uint64_t blocks = 0;        // and pages
    double resident_share = 1;  // of their bytes, 0 to 1
    uint32_t max_depth = 0;
    double rays_per_second = 1, loads_per_second = 1;
    bool sweeps = false;  // PolicyKind::sweep: blocks come in turn, whatever is waited for
};

struct ExpectedSeconds {
    double tracing = 0, waiting = 0;
};

ExpectedSeconds expected_seconds(const WaitNeeds& needs);

// Whether somebody who waits for the picture should hear of it first: more than ten times as long as with everything resident, and some seconds.
bool crawls(const ExpectedSeconds& seconds);

}  // namespace raypager
