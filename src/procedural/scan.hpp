// A laser on an aeroplane over a city: what comes back of each pulse.
#pragma once

#include <cstdint>

#include "procedural/city.hpp"

namespace raypager {

struct ScanPoint {
    double x, y, z;
    double time;  // seconds since take-off
    uint16_t intensity;
    uint16_t flight_line;  // from 1
    int16_t angle;         // across the flight line, in 0.006 degrees
    uint8_t return_number, return_count;
    PointClass kind;
    Rgb8 color;
};

// A pulse as the line x = ground_x + slope_x z, y = ground_y + slope_y z; it comes from above. Slopes are at most 1.
struct Pulse {
    double ground_x, ground_y, slope_x, slope_y;
};

constexpr uint32_t most_returns = 4;

// What a pulse meets from above: at most most_returns points, of which only position, return numbers, class, colour and intensity are filled
// in; the number of them. None where water, glass or a dark surface swallows it. random: of this pulse.
uint32_t scan(const City& city, const Pulse& pulse, Random& random, ScanPoint* returns);

}  // namespace raypager
