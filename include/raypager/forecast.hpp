// What a render would take, without rendering it: its time, and the bytes that it would move onto the device, within the limits that it was given and
// within others. Short parts of it, spread evenly over the whole, are rendered within each limit and timed; the rest follows from these.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "raypager/blocks.hpp"
#include "raypager/session.hpp"
#include "raypager/status.hpp"

namespace raypager {

// Of what pages: in bytes, or in percent of all of it.
struct GeometryLimit {
    uint64_t bytes = 0;
    double percent = 0;  // if bytes is 0
};

struct ForecastOptions {
    std::vector<GeometryLimit> limits;  // to compare with; none: twice, four times and half of what may be resident
    // About so long is measured. All limits are measured once, however long that takes, and then again, three times at most, while there is time: the
    // shortest times count, for what else runs on a machine only adds to them.
    double seconds = 20;
    std::function<void(double fraction)> progress;  // of the measurements; may be empty
    const std::atomic<bool>* stop = nullptr;        // set from outside: an error of the kind "interrupted" follows soon
};

// The render within one limit.
struct ForecastRow {
    uint64_t geometry_bytes = 0;  // that may be resident
    uint64_t memory_bytes = 0;    // all device memory that is used then
    uint64_t paths = 0;           // path slots
    double seconds = 0;           // of rendering: not of baking, building kernels, or writing pictures
    double moved_bytes = 0;       // onto the device, loads of what had been evicted included
    double slow_down = 1;         // seconds, over those with everything resident
    bool measured = true;         // false: by a model of the other rows' times; the device has too little memory for it
};

struct Forecast {
    std::string device;
    uint32_t width = 0, height = 0, spp = 0;
    uint64_t scene_bytes = 0;                    // all that pages, as it is in device memory
    uint64_t samples = 0, samples_measured = 0;  // of the picture; of these, rendered within each limit
    ForecastRow asked, resident;                 // within the limits of the options; with everything resident
    std::vector<ForecastRow> rows;               // these two, and the other limits that there is memory for: the largest first
    // With so much geometry resident, the render would take half as much longer than with everything resident as within the limits of the options;
    // and half of the time. Between rows by interpolation. None: nothing is slower, or no limit does it.
    std::optional<uint64_t> halves_excess, halves_time;
    // By how much, at most, a row took longer than one with less geometry, as a factor: 1 on a quiet machine. Seconds are no better than that.
    double noise = 1;
    double seconds = 0;  // that the forecast took
};

// Fails as the render would: where limits are too small, the message names the smallest that would do. Not for renders that end by the clock or
// sample adaptively.
Result<Forecast> forecast(const Blocks& scene, const RenderOptions& options, const ForecastOptions& how = {}, const RenderCallbacks& callbacks = {});

}  // namespace raypager
