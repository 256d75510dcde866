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

// The scanner looks 20 degrees to either side, and 14 degrees forwards and backwards in turn, so that it sees walls of all sides.
constexpr double half_angle_turns = 20.0 / 360, tan_half_angle = 0.36397023426620234, tan_pitch = 0.24932800284318068;
constexpr double widest_swath = 420, overlap = 0.12;
constexpr double seconds_a_line = 0.01;

// Where the aeroplane flies and how far its pulses are apart.
struct FlightPlan {
    double side = 0, swath = 0, height = 0;  // of the ground, of a strip of it that one flight line covers, of the aeroplane
    uint32_t strips = 0;
    uint64_t lines = 0;   // scan lines of a flight line
    uint32_t pulses = 0;  // of a scan line
    double strip_middle(uint32_t strip) const { return (strip + 0.5) * side / strips; }
};

// Pulses of strip that fall on the city, as a share of all of them.
double share_on_city(const FlightPlan& plan, uint32_t strip) {
    constexpr int steps = 4096;
    int inside = 0;
    for (int i = 0; i < steps; ++i) {
        const double turns = half_angle_turns * ((2 * i + 1.0) / steps - 1);
        const SinCos angle = sincos_turns(turns);
        const double x = plan.strip_middle(strip) + plan.height * angle.sin / angle.cos;
        inside += x >= 0 && x < plan.side;
    }
    return static_cast<double>(inside) / steps;
}

// Points that come back of a pulse, on the average.
double returns_a_pulse(const City& city, uint64_t seed) {
    constexpr int pulses = 16384;
    Random random(seed, 0xa11);
    uint64_t returns = 0;
    ScanPoint points[most_returns];
    for (int i = 0; i < pulses; ++i) {
        const double x = random.uniform(0, city.side()), y = random.uniform(0, city.side());
        const double slope = random.uniform(-tan_half_angle, tan_half_angle);
        returns += scan(city, {x, y, slope, random.uniform() < 0.5 ? tan_pitch : -tan_pitch}, random, points);
    }
    return std::max(0.05, static_cast<double>(returns) / pulses);
}

FlightPlan plan_flight(const City& city, uint64_t points, uint64_t seed) {
    FlightPlan plan;
    plan.side = city.side();
    plan.strips = static_cast<uint32_t>(std::ceil(plan.side * (1 + overlap) / widest_swath));
    plan.swath = plan.side / plan.strips * (1 + overlap);
    plan.height = 0.5 * plan.swath / tan_half_angle;
    double shares = 0;
    for (uint32_t strip = 0; strip < plan.strips; ++strip) shares += share_on_city(plan, strip);
    // Pulses on the city: lines * pulses * shares, with the same spacing along and across.
    const double wanted = static_cast<double>(points) / returns_a_pulse(city, seed);
    const double spacing = std::sqrt(plan.side * plan.swath * shares / wanted);
    plan.lines = static_cast<uint64_t>(std::max(1.0, std::round(plan.side / spacing)));
    plan.pulses = static_cast<uint32_t>(std::max(1.0, std::round(wanted / (shares * static_cast<double>(plan.lines)))));
    return plan;
}

class Flight {
public:
    Flight(const City& city, const FlightPlan& plan, uint64_t seed) : city_(city), plan_(plan), seed_(seed) {}

    // Scan lines are numbered through all flight lines. Each has random numbers of its own, so that it does not matter who scans it.
    uint64_t lines() const { return plan_.strips * plan_.lines; }
    void scan_line(uint64_t number, std::vector<ScanPoint>& points) const {
        const auto strip = static_cast<uint32_t>(number / plan_.lines);
        const uint64_t line = number % plan_.lines;
        const double spacing = plan_.side / static_cast<double>(plan_.lines), middle = plan_.strip_middle(strip);
        const double pitch = line % 2 ? tan_pitch : -tan_pitch;
        Random random(seed_, number + 1);
        for (uint32_t i = 0; i < plan_.pulses; ++i) {
            const double along = (i + random.uniform(0.2, 0.8)) / plan_.pulses;
            const SinCos angle = sincos_turns(half_angle_turns * (2 * along - 1));
            const double slope = -angle.sin / angle.cos;
            const Pulse pulse = {middle - plan_.height * slope, (static_cast<double>(line) + 0.9 * along + 0.1 * random.uniform()) * spacing, slope,
                                 pitch};
            if (pulse.ground_x < 0 || pulse.ground_x >= plan_.side) continue;
            ScanPoint returns[most_returns];
            const uint32_t count = scan(city_, pulse, random, returns);
            for (uint32_t r = 0; r < count; ++r) {
                ScanPoint& p = points.emplace_back(returns[r]);
                p.time = (static_cast<double>(number) + along) * seconds_a_line;
                p.flight_line = static_cast<uint16_t>(strip + 1);
                p.angle = static_cast<int16_t>((2 * along - 1) * (20 / 0.006));
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

    const double side = plan.side;
    scene->begin(fmt::format("Scan of a city of {} points, seed {}; metres", writer->count(), options.seed),
                 {.eye = {0.62 * side, -0.42 * side, 0.42 * side}, .target = {0.5 * side, 0.44 * side, 0}, .up = {0, 0, 1}, .fov_degrees = 38});
    scene->diffuse("points", {0.5, 0.5, 0.5});
    scene->sky({0.42, 0.55, 0.75});
    scene->sun({-0.75, -0.45, 0.75}, {2.9, 2.6, 2.15});
    scene->points(name, "points", writer->count(), writer->bytes());
    return scene->finish();
}

}  // namespace raypager
