#include "bench/pilot.hpp"

#include <algorithm>

#include "base/check.hpp"

namespace raypager::bench {
namespace {

// The stretches of a render's samples begin behind an eighth of them, a sixteenth and so on: no part is to lie there, where for once the picture's
// end meets its beginning.
constexpr uint64_t shares = 10;
// In path slots. What a render does changes within about as many paths as are under way.
constexpr uint64_t least_beginning = 2, most_beginning = 4;

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

std::vector<PilotPart> pilot_parts(uint64_t samples, uint64_t pixels, uint64_t slots) {
    const uint64_t beginning = std::clamp(pixels, least_beginning * slots, most_beginning * slots);
    const uint64_t warm = slots + slots / 2, measured = slots + slots / 2, share = samples / shares;
    if (beginning + shares * (warm + measured) > samples / 2) return {{0, 0, samples}};
    std::vector<PilotPart> parts = {{0, 0, beginning}};
    for (uint64_t i = 0; i < shares; i++) {
        // A render's beginning may reach into its first share.
        const uint64_t begin = std::max(i * share + (share - measured) / 2 - warm, parts.back().end);
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
    course.beginning = course.beginning - static_cast<double>(parts.front().end) * course.paces.front();
    course.end = all.back().extent - last;
    return course;
}

Course quickest(std::span<const Course> courses) {
    RAYPAGER_CHECK(!courses.empty());
    Course course;
    course.beginning = quickest_piece(courses, [](const Course& c) { return c.beginning; });
    course.end = quickest_piece(courses, [](const Course& c) { return c.end; });
    for (size_t i = 0; i < courses.front().paces.size(); i++)
        course.paces.push_back(quickest_piece(courses, [i](const Course& c) { return c.paces[i]; }));
    return course;
}

Extent whole_extent(const Course& course, uint64_t samples) {
    Extent sum = course.beginning + course.end;
    for (const Extent& pace : course.paces) sum = sum + static_cast<double>(samples) / static_cast<double>(course.paces.size()) * pace;
    // The beginning's excess may be negative where it has little to load, but nothing takes less than nothing.
    sum.bytes = std::max(sum.bytes, 0.0);
    return sum;
}

}  // namespace raypager::bench
