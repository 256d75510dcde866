// What a forecast computes from what it measured: answers by hand, and what must hold for all.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "bench/clock_model.hpp"
#include "bench/limit_curve.hpp"
#include "bench/pilot.hpp"

namespace raypager::bench {
namespace {

TEST(PilotParts, follow_each_other_and_lie_in_the_render) {
    std::random_device device;
    const uint64_t seed = device();
    std::mt19937_64 random(seed);
    SCOPED_TRACE("seed " + std::to_string(seed));
    for (int i = 0; i < 2000; i++) {
        const uint64_t pixels = 1 + random() % 100000, samples = pixels * (1 + random() % 1000), slots = 1 + random() % 100000;
        const auto parts = pilot_parts(samples, pixels, slots);
        ASSERT_FALSE(parts.empty());
        EXPECT_EQ(parts.front().begin, 0u);
        uint64_t end = 0, all = 0;
        for (const PilotPart& part : parts) {
            ASSERT_GE(part.begin, end);
            ASSERT_GE(part.from, part.begin);
            ASSERT_GT(part.end, part.from);
            end = part.end;
            all += part.end - part.begin;
        }
        ASSERT_LE(end, samples);
        if (parts.size() > 1)
            ASSERT_LE(all, samples / 2);
        else
            ASSERT_EQ(end, samples);
    }
}

TEST(PilotParts, a_short_render_is_measured_as_a_whole) {
    EXPECT_EQ(pilot_parts(1000, 100, 100).size(), 1u);
    EXPECT_EQ(pilot_parts(100000, 100, 100).size(), 6u);
}

// Marks of a render that goes through these parts: `beginning` seconds pass before its first sample, sample s takes pace(s), and the last paths take
// `end`. A round begins `step` samples, or what is left of the part.
template <typename Pace>
std::vector<PilotMark> marks_of(const std::vector<PilotPart>& parts, double beginning, double end, uint64_t step, const Pace& pace) {
    std::vector<PilotMark> marks;
    Extent now{beginning, 0, 0, 0};
    for (const PilotPart& part : parts)
        for (uint64_t at = part.begin; at < part.end;) {
            const uint64_t next = std::min(at + step, part.end);
            for (; at < next; at++) now.seconds += pace(at), now.rays += 3, now.bytes += 7;
            now.rounds++;
            marks.push_back({at, now});
        }
    now.seconds += end;
    marks.push_back({parts.back().end, now});
    return marks;
}

TEST(Course, of_an_even_render_is_that_of_the_whole) {
    constexpr uint64_t samples = 60000, pixels = 300, slots = 500;
    const auto parts = pilot_parts(samples, pixels, slots);
    ASSERT_GT(parts.size(), 1u);
    for (const uint64_t step : {1u, 7u, 100u, 400u}) {
        const auto marks = marks_of(parts, 2, 0.5, step, [](uint64_t) { return 1e-3; });
        const Extent whole = whole_extent(course_of(marks, parts), samples);
        EXPECT_NEAR(whole.seconds, 2 + 60 + 0.5, 1e-6) << "step " << step;
        EXPECT_NEAR(whole.rays, 3.0 * samples, 1e-3);
        EXPECT_NEAR(whole.bytes, 7.0 * samples, 1e-3);
    }
}

TEST(Course, each_share_goes_on_at_the_pace_of_its_part) {
    constexpr uint64_t samples = 120000, pixels = 300, slots = 500;
    const auto parts = pilot_parts(samples, pixels, slots);
    const uint64_t first = last_stretch(samples, pixels);
    ASSERT_EQ(first, 15000u);
    ASSERT_LE(parts.front().end, first);
    const auto pace = [&](uint64_t sample) {
        return 1e-3 * (sample < first ? 2 : 1 + static_cast<double>((sample - first) / ((samples - first) / 5)));
    };
    const auto marks = marks_of(parts, 0, 0, 50, pace);
    const auto beginning = static_cast<double>(parts.front().end);
    // The mean of 1 to 5 ms.
    EXPECT_NEAR(whole_extent(course_of(marks, parts), samples).seconds, 2e-3 * beginning + 3e-3 * (samples - beginning), 1e-6);
}

// What the first ways through the picture had to load, the later ones of their kind have to load again.
TEST(Course, later_sweeps_move_as_much_as_the_first) {
    EXPECT_NEAR(later_sweeps(64 * 300, 300, 2 * 300), 1, 1e-9);  // 0, 1 | 2 to 3, 4 to 7 | 8 to 63
    EXPECT_NEAR(later_sweeps(1024 * 300, 300, 300), 7, 1e-9);    // 0 | 1, 2 to 3, 4 to 7, ..., 64 to 127 | 128 to 1023
    EXPECT_NEAR(later_sweeps(8 * 300, 300, 300), 0, 1e-9);       // 0 | 1 to 7
    EXPECT_NEAR(later_sweeps(8 * 300, 300, 600), 0, 1e-9);
    Course course;
    course.beginning.bytes = 100;
    course.paces = {{0, 0, 0, 2}};
    course.later_sweeps = 1.5;
    EXPECT_NEAR(whole_extent(course, 1000).bytes, 100 + 150 + 2000, 1e-9);
}

TEST(Course, of_one_part_is_what_was_measured) {
    const std::vector<PilotPart> parts = {{0, 0, 100}};
    const auto marks = marks_of(parts, 1, 2, 30, [](uint64_t) { return 0.01; });
    EXPECT_NEAR(whole_extent(course_of(marks, parts), 100).seconds, 4, 1e-9);
}

TEST(Course, what_disturbs_one_of_several_does_not_count) {
    constexpr uint64_t samples = 60000, pixels = 300, slots = 500;
    const auto parts = pilot_parts(samples, pixels, slots);
    std::vector<Course> courses;
    for (uint64_t disturbed = 0; disturbed < 3; disturbed++) {
        const auto pace = [&](uint64_t sample) { return sample * 3 / samples == disturbed && sample > 1000 ? 5e-3 : 1e-3; };
        courses.push_back(course_of(marks_of(parts, 0, 0, 100, pace), parts));
    }
    for (const Extent& piece : quickest(courses).paces) EXPECT_NEAR(piece.seconds, 1e-3, 1e-9);
    EXPECT_GT(whole_extent(courses.front(), samples).seconds, 1.5e-3 * samples);
}

TEST(ClockModel, finds_the_costs_that_made_the_times) {
    std::mt19937_64 random(5);
    const auto any = [&](double most) { return most * static_cast<double>(random() % 1000 + 1) / 1000; };
    for (const ClockModel truth : {ClockModel{2e-8, 1e-3, 3e-10}, ClockModel{2e-8, 0, 3e-10}, ClockModel{2e-8, 0, 0}, ClockModel{0, 1e-3, 0}}) {
        std::vector<Extent> measured;
        for (int i = 0; i < 40; i++) {
            Extent extent{0, any(1e7), any(200), any(1e9)};
            extent.seconds = truth.seconds(extent.rays, extent.rounds, extent.bytes);
            measured.push_back(extent);
        }
        const ClockModel found = fit_clock(measured);
        EXPECT_NEAR(found.per_ray, truth.per_ray, 1e-6 * 2e-8);
        EXPECT_NEAR(found.per_round, truth.per_round, 1e-6 * 1e-3);
        EXPECT_NEAR(found.per_byte, truth.per_byte, 1e-6 * 3e-10);
    }
}

TEST(ClockModel, no_cost_is_negative_whatever_was_measured) {
    std::random_device device;
    const uint64_t seed = device();
    std::mt19937_64 random(seed);
    SCOPED_TRACE("seed " + std::to_string(seed));
    for (int trial = 0; trial < 500; trial++) {
        std::vector<Extent> measured(random() % 6);
        for (Extent& extent : measured)
            extent = {static_cast<double>(random() % 4), static_cast<double>(random() % 1000), static_cast<double>(random() % 5),
                      static_cast<double>(random() % 3)};
        const ClockModel model = fit_clock(measured);
        EXPECT_GE(model.per_ray, 0);
        EXPECT_GE(model.per_round, 0);
        EXPECT_GE(model.per_byte, 0);
        EXPECT_LT(model.seconds(1, 1, 1), 1e9);
    }
    EXPECT_EQ(fit_clock({}).seconds(1, 1, 1), 0);
}

TEST(LimitCurve, by_hand) {
    const std::vector<LimitPoint> points = {{100, 9}, {200, 5}, {400, 3}, {800, 3}};
    EXPECT_EQ(limit_for(points, 9), 100u);
    EXPECT_EQ(limit_for(points, 5), 200u);
    EXPECT_EQ(limit_for(points, 4), 283u);  // 200 times the root of 2
    EXPECT_EQ(limit_for(points, 3), 400u);
    EXPECT_EQ(limit_for(points, 2.9), std::nullopt);
    EXPECT_EQ(limit_for(std::vector<LimitPoint>{{100, 9}}, 9), std::nullopt);
    // More geometry that took longer by chance.
    EXPECT_EQ(limit_for(std::vector<LimitPoint>{{100, 5}, {200, 6}, {400, 4}}, 4.5), 283u);
}

TEST(LimitCurve, less_time_takes_more_memory) {
    std::random_device device;
    const uint64_t seed = device();
    std::mt19937_64 random(seed);
    SCOPED_TRACE("seed " + std::to_string(seed));
    for (int trial = 0; trial < 500; trial++) {
        std::vector<LimitPoint> points;
        uint64_t bytes = 1 + random() % 100;
        for (uint64_t i = 2 + random() % 6; i > 0; i--, bytes += 1 + random() % 100)
            points.push_back({bytes, 1 + static_cast<double>(random() % 100)});
        uint64_t before = 0;
        for (double seconds = 101; seconds > 0; seconds -= 0.5) {
            const auto limit = limit_for(points, seconds);
            if (!limit) break;
            EXPECT_GE(*limit, before);
            EXPECT_LE(*limit, points.back().geometry_bytes);
            before = *limit;
        }
    }
}

}  // namespace
}  // namespace raypager::bench
