// Parts of a render, measured, and what follows from them for the whole of it. Pure arithmetic.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace raypager::bench {

// Samples begin .. end - 1 are rendered, those from `from` on are measured: the ones before bring path slots and resident blocks into the state that
// they have there in the whole render.
struct PilotPart {
    uint64_t begin = 0, from = 0, end = 0;
};

// Where the last stretch of a render begins, which has most of its samples, region by region (wavefront/sample_order.hpp).
uint64_t last_stretch(uint64_t samples, uint64_t pixels);
// For a render of so many samples. The first part is the render's beginning, with most of its first loads; the others lie evenly over its last
// stretch, each in the middle of a share of its own. One part alone, which is all of the render, where they would be half of it or more.
std::vector<PilotPart> pilot_parts(uint64_t samples, uint64_t pixels, uint64_t slots);

struct Extent {
    double seconds = 0, rays = 0, rounds = 0;
    double bytes = 0;  // of blocks that were evicted
};

// Where a render was after a round.
struct PilotMark {
    uint64_t begun = 0;  // samples of all parts so far
    Extent extent;       // of all parts so far
};

// The stretches before the last one are short: each is a way through the whole picture, a sweep. Sweeps that begin behind the first `begun` samples
// and before the last stretch, over those that begin before.
double later_sweeps(uint64_t samples, uint64_t pixels, uint64_t begun);

// A render in pieces: the beginning is what it took more than its samples do later; paces are per sample, of each share; then come the last paths.
struct Course {
    Extent beginning, end;
    double later_sweeps = 0;  // so many times what the beginning evicted, the sweeps behind it evict
    std::vector<Extent> paces;
};
// One part: all is in the beginning. Here parts follow each other: their places are among the samples that are begun.
Course course_of(std::span<const PilotMark> marks, std::span<const PilotPart> parts);
// The shortest time of each piece, and the mean of what else there is. REQUIRES: at least one, all of the same parts.
Course quickest(std::span<const Course> courses);
// Of the whole render of so many samples.
Extent whole_extent(const Course& course, uint64_t samples);

}  // namespace raypager::bench
