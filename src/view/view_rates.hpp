// What a render does per second, from its counts over about the last one.
#pragma once

#include <deque>

#include "raypager/session.hpp"

namespace raypager {

struct ViewRates {
    double rays = 0, loads = 0, bytes = 0;  // per second
};

class RateMeter {
public:
    // seconds: of a clock that goes on while counts begin anew.
    void add(double seconds, const RenderProgress& progress);
    void begin_anew() { samples_.clear(); }
    ViewRates rates() const;

private:
    struct Sample {
        double seconds;
        uint64_t rays, loads, bytes;
    };
    std::deque<Sample> samples_;  // the oldest first, a few per second
};

}  // namespace raypager
