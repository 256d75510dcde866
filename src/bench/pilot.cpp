#include "bench/pilot.hpp"

#include <algorithm>
#include <cmath>

#include "base/check.hpp"
#include "raypager/abi/scene.h"

namespace raypager::bench {
namespace {

constexpr uint64_t shares = 5;
// In path slots. After a jump to another place it takes a few generations of paths until what is resident suits it: the more, the larger the pool.
constexpr uint64_t warm_length = 3, measured_length = 3, least_beginning = 2, most_beginning = 4;

Extent operator-(const Extent& a, const Extent& b) { return {a.seconds - b.seconds, a.rays - b.rays, a.rounds - b.rounds, a.bytes - b.bytes}; }
Extent operator+(const Extent& a, const Extent& b) { return {a.seconds + b.seconds, a.rays + b.rays, a.rounds + b.rounds, a.bytes + b.bytes}; }
Extent operator*(double f, const Extent& a) { return {f * a.seconds, f * a.rays, f * a.rounds, f * a.bytes}; }

// What there was when `sample` began, between two rounds in proportion. marks: those of the part behind the first, which is the last one before it.
Extent when_begun(std::span<const PilotMark> marks, const PilotPart& part, uint64_t sample) {
    for (size_t i = 1; i < marks.size(); i++) {
        if (marks[i].begun < sample) continue;
        const uint64_t before = i == 1 ? part.begin : marks[i - 1].begun;
        const double share = marks[i].begun > before ? static_cast<double>(sample - before) / static_cast<double>(marks[i].begun - before) : 1;
        return marks[i - 1].extent + share * (marks[i].extent - marks[i - 1].extent);
    }
    return marks.back().extent;
}

Extent quickest_piece(std::span<const Course> courses, const auto& piece_of) {
    Extent sum;
    double seconds = piece_of(courses.front()).seconds;
    for (const Course& course : courses) {
        sum = sum + piece_of(course);
        seconds = std::min(seconds, piece_of(course).seconds);
    }
    Extent piece = 1 / static_cast<double>(courses.size()) * sum;
    piece.seconds = seconds;
    return piece;
}

}  // namespace

uint64_t last_stretch(uint64_t samples, uint64_t pixels) {
    const uint64_t passes = samples / std::max<uint64_t>(1, pixels);
    return (passes + RP_LAST_STRETCH - 1) / RP_LAST_STRETCH * pixels;
}

std::vector<PilotPart> pilot_parts(uint64_t samples, uint64_t pixels, uint64_t slots) {
    const uint64_t beginning = std::clamp(2 * pixels, least_beginning * slots, most_beginning * slots);
    const uint64_t warm = warm_length * slots, measured = measured_length * slots, first = last_stretch(samples, pixels);
    const uint64_t share = (samples - std::min(samples, first)) / shares;
    if (beginning + shares * (warm + measured) > samples / 2 || share < warm + measured) return {{0, 0, samples}};
    std::vector<PilotPart> parts = {{0, 0, beginning}};
    for (uint64_t i = 0; i < shares; i++) {
        const uint64_t begin = std::max(first + i * share + (share - warm - measured) / 2, parts.back().end);
        parts.push_back({begin, begin + warm, begin + warm + measured});
    }
    return parts;
}

Course course_of(std::span<const PilotMark> marks, std::span<const PilotPart> parts) {
    RAYPAGER_CHECK(!marks.empty() && !parts.empty());
    Course course;
    if (parts.size() == 1) {
        course.beginning = marks.back().extent;
        return course;
    }
    std::vector<PilotMark> all = {PilotMark()};
    all.insert(all.end(), marks.begin(), marks.end());
    size_t at = 0;
    Extent last;
    for (const PilotPart& part : parts) {
        size_t end = at + 1;
        while (end + 1 < all.size() && all[end].begun < part.end) end++;
        const std::span<const PilotMark> own = std::span(all).subspan(at, end - at + 1);
        last = when_begun(own, part, part.end);
        if (&part == &parts.front())
            course.beginning = last;
        else
            course.paces.push_back(1 / static_cast<double>(part.end - part.from) * (last - when_begun(own, part, part.from)));
        at = end;
    }
    Extent mean;
    for (const Extent& pace : course.paces) mean = mean + 1 / static_cast<double>(course.paces.size()) * pace;
    course.beginning = course.beginning - static_cast<double>(parts.front().end) * mean;
    course.end = all.back().extent - last;
    return course;
}

Course quickest(std::span<const Course> courses) {
    RAYPAGER_CHECK(!courses.empty());
    Course course;
    course.beginning = quickest_piece(courses, [](const Course& c) { return c.beginning; });
    course.later_sweeps = courses.front().later_sweeps;
    course.end = quickest_piece(courses, [](const Course& c) { return c.end; });
    for (size_t i = 0; i < courses.front().paces.size(); i++)
        course.paces.push_back(quickest_piece(courses, [i](const Course& c) { return c.paces[i]; }));
    return course;
}

double later_sweeps(uint64_t samples, uint64_t pixels, uint64_t begun) {
    // How many stretches begin behind so many passes, in parts of a stretch.
    const auto sweeps = [](double passes) { return passes < 1 ? passes : 1 + std::log2(passes); };
    const double passes = static_cast<double>(last_stretch(samples, pixels)) / static_cast<double>(pixels);
    const double seen = sweeps(static_cast<double>(begun) / static_cast<double>(pixels));
    return std::max(0.0, sweeps(passes) - seen) / seen;
}

Extent whole_extent(const Course& course, uint64_t samples) {
    Extent sum = course.beginning + course.end;
    sum.bytes += course.later_sweeps * std::max(0.0, course.beginning.bytes);
    for (const Extent& pace : course.paces) sum = sum + static_cast<double>(samples) / static_cast<double>(course.paces.size()) * pace;
    // The beginning's excess may be negative where it has little to load, but nothing takes less than nothing.
    sum.bytes = std::max(sum.bytes, 0.0);
    return sum;
}

}  // namespace raypager::bench
