// A city as an aeroplane with a laser scanner sees it, from flight lines side by side. Units are metres; x east, y north, z up.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/parallel.hpp"
#include "procedural/kinds.hpp"
#include "procedural/point_writer.hpp"
#include "procedural/scan.hpp"
#include "procedural/scene_writer.hpp"

namespace raypager {
namespace {

// The more points, the larger the city and the finer the scan: 10 points a square metre for a million, 96 for a billion.
double city_side(uint64_t points) { return 150 * std::cbrt(static_cast<double>(points) / 1e5); }

// The scanner looks up to 28 degrees to either side. Its mirror wobbles, so that it also looks up to 35 degrees forwards and backwards, with
// each pulse elsewhere: it sees walls of all sides, and no rows on them.
constexpr double half_angle_turns = 28.0 / 360, tan_half_angle = 0.5317094316614788, tan_pitch = 0.7002075382097097;
constexpr double widest_swath = 420, overlap = 0.12;
// Slanting pulses are aimed at where the ground is as a rule; from so far outside, some still meet the city. What they meet outside does
// not count.
constexpr double margin = 12;
constexpr double seconds_a_line = 0.01;

// Where the aeroplane flies and how far its pulses are apart.
struct FlightPlan {
    double length = 0;             // of the square that is flown over: the city and a margin
    double swath = 0, height = 0;  // of a strip of it that one flight line covers; of the aeroplane
    uint32_t strips = 0;
    uint64_t lines = 0;   // scan lines of a flight line
    uint32_t pulses = 0;  // of a scan line
    double strip_middle(uint32_t strip) const { return (strip + 0.5) * length / strips - margin; }
};

// Across a flight line, `along` (0 to 1) of its strip; y is from the city's south border on.
Pulse aim(const FlightPlan& plan, uint32_t strip, double along, double y, Random& random) {
    const SinCos angle = sincos_turns(half_angle_turns * (2 * along - 1));
    const double slope_x = -angle.sin / angle.cos, slope_y = random.uniform(-tan_pitch, tan_pitch);
    const double x = plan.strip_middle(strip) - plan.height * slope_x;
    return {x - slope_x * City::typical_height, y - slope_y * City::typical_height, slope_x, slope_y};
}

// What comes back of a pulse that ends in the city.
uint32_t scan_inside(const City& city, const Pulse& pulse, Random& random, ScanPoint* returns) {
    const uint32_t count = scan(city, pulse, random, returns);
    if (count == 0) return 0;
    const ScanPoint& last = returns[count - 1];
    return last.x >= 0 && last.x < city.side() && last.y >= 0 && last.y < city.side() ? count : 0;
}

// Points that come back of a pulse, on the average.
double returns_a_pulse(const City& city, const FlightPlan& plan, uint64_t seed) {
    constexpr int pulses = 32768;
    Random random(seed, 0xa11);
    uint64_t returns = 0;
    ScanPoint points[most_returns];
    for (int i = 0; i < pulses; ++i) {
        const uint32_t strip = random.below(plan.strips);
        const double along = random.uniform(), y = random.uniform(-margin, plan.length - margin);
        returns += scan_inside(city, aim(plan, strip, along, y, random), random, points);
    }
    return std::max(0.05, static_cast<double>(returns) / pulses);
}

FlightPlan plan_flight(const City& city, uint64_t points, uint64_t seed) {
    FlightPlan plan;
    plan.length = city.side() + 2 * margin;
    plan.strips = static_cast<uint32_t>(std::ceil(plan.length * (1 + overlap) / widest_swath));
    plan.swath = plan.length / plan.strips * (1 + overlap);
    plan.height = 0.5 * plan.swath / tan_half_angle;
    // As far apart along the flight lines as across.
    const double wanted = static_cast<double>(points) / returns_a_pulse(city, plan, seed) / plan.strips;
    plan.lines = static_cast<uint64_t>(std::max(1.0, std::round(std::sqrt(wanted * plan.length / plan.swath))));
    plan.pulses = static_cast<uint32_t>(std::max(1.0, std::round(wanted / static_cast<double>(plan.lines))));
    return plan;
}

class Flight {
public:
    Flight(const City& city, const FlightPlan& plan, uint64_t seed) : city_(city), plan_(plan), seed_(seed) {}

    // Scan lines are numbered through all flight lines. Each has random numbers of its own, so that it does not matter who scans it.
    uint64_t lines() const { return plan_.strips * plan_.lines; }
    void scan_line(uint64_t number, std::vector<ScanPoint>& points) const {
        const auto strip = static_cast<uint32_t>(number / plan_.lines);
        const auto line = static_cast<double>(number % plan_.lines);
        const double spacing = plan_.length / static_cast<double>(plan_.lines);
        Random random(seed_, number + 1);
        for (uint32_t i = 0; i < plan_.pulses; ++i) {
            const double along = (i + random.uniform(0.2, 0.8)) / plan_.pulses;
            const double y = (line + 0.9 * along + 0.1 * random.uniform()) * spacing - margin;  // it flies on meanwhile
            ScanPoint returns[most_returns];
            const uint32_t count = scan_inside(city_, aim(plan_, strip, along, y, random), random, returns);
            for (uint32_t r = 0; r < count; ++r) {
                ScanPoint& p = points.emplace_back(returns[r]);
                p.time = (static_cast<double>(number) + along) * seconds_a_line;
                p.flight_line = static_cast<uint16_t>(strip + 1);
                p.angle = static_cast<int16_t>((2 * along - 1) * (28 / 0.006));
            }
        }
    }

private:
    const City& city_;
    const FlightPlan& plan_;
    uint64_t seed_;
};

// Scan lines are worked on in batches: all cores scan, then the points are written in order. Memory does not grow with the scene.
Status write_points(const Flight& flight, const FlightPlan& plan, PointWriter& writer) {
    constexpr uint64_t task_pulses = 1 << 14, batch_tasks = 32;
    const uint64_t task_lines = std::max<uint64_t>(1, task_pulses / plan.pulses);
    std::vector<std::vector<ScanPoint>> tasks(batch_tasks);
    for (uint64_t first = 0; first < flight.lines(); first += task_lines * batch_tasks) {
        const uint64_t tasks_left = (flight.lines() - first + task_lines - 1) / task_lines;
        const auto count = static_cast<size_t>(std::min(batch_tasks, tasks_left));
        parallel_for(count, 1, [&](size_t begin, size_t end) {
            for (size_t t = begin; t < end; ++t) {
                tasks[t].clear();
                const uint64_t line = first + t * task_lines;
                for (uint64_t l = line; l < std::min(line + task_lines, flight.lines()); ++l) flight.scan_line(l, tasks[t]);
            }
        });
        for (size_t t = 0; t < count; ++t) RAYPAGER_TRY(writer.add(tasks[t]));
    }
    return {};
}

}  // namespace

Result<MadeScene> make_points(const MakeSceneOptions& options) {
    auto scene = SceneWriter::create(options);
    if (!scene) return scene.status();
    const City city(city_side(options.points), options.seed);
    const FlightPlan plan = plan_flight(city, options.points, options.seed);
    const Flight flight(city, plan, mix_bits(options.seed + 1));

    const char* const name = options.format == PointFormat::las ? "points.las" : "points.ply";
    auto writer = PointWriter::create(options.directory / name, options.format);
    if (!writer) return writer.status();
    RAYPAGER_TRY(write_points(flight, plan, *writer));
    RAYPAGER_TRY(writer->commit());

    const double side = city.side();
    scene->begin(fmt::format("Scan of a city of {} points, seed {}; metres", writer->count(), options.seed),
                 {.eye = {0.66 * side, -0.50 * side, 0.46 * side}, .target = {0.51 * side, 0.42 * side, 0}, .up = {0, 0, 1}, .fov_degrees = 36});
    scene->diffuse("points", {0.5, 0.5, 0.5});
    scene->sky({0.42, 0.55, 0.75});
    scene->sun({-0.75, -0.45, 0.75}, {2.9, 2.6, 2.15});
    scene->points(name, "points", writer->count(), writer->bytes());
    return scene->finish();
}

}  // namespace raypager
