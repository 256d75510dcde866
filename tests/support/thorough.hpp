// Tests that try many combinations of options try a part of them, another part for each scene, unless RAYPAGER_THOROUGH is set (.ci/full).
#pragma once

#include <cstdint>
#include <cstdlib>

namespace raypager::support {

inline bool thorough() { return std::getenv("RAYPAGER_THOROUGH") != nullptr; }

// Asked once for each combination, says whether to try it: every n-th, from the first on or a later one.
class Turns {
public:
    Turns(uint64_t first, uint32_t every) : next_(first), every_(every) {}
    bool take() { return next_++ % every_ == 0 || thorough(); }

private:
    uint64_t next_;
    uint32_t every_;
};

}  // namespace raypager::support
