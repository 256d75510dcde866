#include "procedural/assemblies.hpp"

#include <algorithm>
#include <cmath>

namespace raypager {
namespace {

Stuff any_metal(Random& random) {
    constexpr Stuff metals[] = {Stuff::steel, Stuff::steel, Stuff::iron, Stuff::brass, Stuff::copper, Stuff::chrome};
    return metals[random.below(6)];
}

Stuff any_paint(Random& random) {
    constexpr Stuff paints[] = {Stuff::red, Stuff::blue, Stuff::yellow, Stuff::white, Stuff::white, Stuff::rubber};
    return paints[random.below(6)];
}

// At least low, whatever the detail.
uint32_t scaled(double count, double detail, uint32_t low) { return std::max(low, static_cast<uint32_t>(count * detail)); }

// Heads on the circle of a flange that faces along the y axis of place.
void add_bolt_circle(Assembly& assembly, const Pose& place, double radius, double bolt, uint32_t count, double detail) {
    for (uint32_t i = 0; i < count; i++) {
        const SinCos angle = sincos_turns(static_cast<double>(i) / count);
        add_bolt(assembly.of(Stuff::chrome), place.moved(radius * angle.cos, 0, radius * angle.sin), bolt, 5 * bolt, segments_for(bolt, detail),
                 scaled(2, detail, 1));
    }
}

void add_flanged_pipe(Assembly& assembly, const Pose& place, double size, double detail, Random& random) {
    const double radius = size * random.uniform(0.06, 0.2), length = size * random.uniform(1, 2.5);
    const double wide = 1.6 * radius, thick = 0.3 * radius, bore = 0.85 * radius;
    const std::array<Point2, 8> profile = {
        {{bore, 0}, {wide, 0}, {wide, thick}, {radius, thick}, {radius, length - thick}, {wide, length - thick}, {wide, length}, {bore, length}}};
    add_turned(assembly.of(random.below(2) == 0 ? any_metal(random) : any_paint(random)), place, profile, segments_for(wide, detail), true);
    const uint32_t bolts = 6 + 2 * random.below(4);
    add_bolt_circle(assembly, place.moved(0, length, 0), 1.3 * radius, 0.09 * radius, bolts, detail);
}

void add_gear_shaft(Assembly& assembly, const Pose& place, double size, double detail, Random& random) {
    const double shaft = size * random.uniform(0.05, 0.09), length = size * random.uniform(0.8, 1.6);
    add_cylinder(assembly.of(Stuff::chrome), place, shaft, length, segments_for(shaft, detail));
    const uint32_t gears = 2 + random.below(4);
    for (uint32_t i = 0; i < gears; i++) {
        const double radius = size * random.uniform(0.2, 0.6), width = 0.5 * length / gears;
        const auto teeth = static_cast<uint32_t>(std::clamp(14 + 40 * radius, 12.0, 72.0));
        add_gear(assembly.of(any_metal(random)), place.moved(0, length * (i + 0.25) / gears, 0), radius, teeth, 1.02 * shaft, width,
                 scaled(3, detail, 1));
    }
}

void add_bolted_plate(Assembly& assembly, const Pose& place, double size, double detail, Random& random) {
    const uint32_t columns = 2 + random.below(9), rows = 1 + random.below(5);
    const double cell = size / std::max(columns, rows), hole = 0.28 * cell, thick = 0.25 * cell;
    add_perforated_plate(assembly.of(random.below(2) == 0 ? Stuff::iron : any_paint(random)), place, columns, rows, cell, hole, scaled(3, detail, 1),
                         thick);
    for (uint32_t row = 0; row < rows; row++)
        for (uint32_t column = 0; column < columns; column++) {
            if (random.below(3) == 0) continue;  // some are missing
            const Pose hole_place = place.moved((column + 0.5 - 0.5 * columns) * cell, thick, (row + 0.5 - 0.5 * rows) * cell);
            const double length = cell * random.uniform(0.8, 1.6);
            add_bolt(assembly.of(any_metal(random)), hole_place, 0.9 * hole, length, segments_for(hole, detail), scaled(4, detail, 1));
        }
}

void add_strut(Assembly& assembly, const Pose& place, double size, double detail, Random& random) {
    const double radius = size * random.uniform(0.12, 0.2), height = size * random.uniform(0.7, 1.2), wire = radius * random.uniform(0.08, 0.2);
    const uint32_t turns = 5 + random.below(10);
    add_spring(assembly.of(any_paint(random)), place, radius, wire, height, turns, std::max(5u, segments_for(radius, detail) / 2));
    add_cylinder(assembly.of(Stuff::chrome), place, 0.5 * radius, 1.2 * height, segments_for(radius, detail));
    for (const double y : {-0.05, 1.0})
        add_cylinder(assembly.of(Stuff::iron), place.moved(0, y * height, 0), 1.4 * radius, 0.05 * height, segments_for(radius, detail));
}

void add_hose(Assembly& assembly, const Pose& place, double size, double detail, Random& random) {
    // A curve that keeps changing its direction, by less than 50 degrees a step.
    const uint32_t steps = scaled(40, detail, 8);
    const double step = 3 * size / steps;
    std::vector<Vector> path = {place.origin};
    Vector heading = place.y, turn = random.direction();
    for (uint32_t i = 0; i < steps; i++) {
        if (i % std::max(1u, steps / 6) == 0) turn = random.direction();
        heading = unit(heading + turn * (6.0 / steps));
        path.push_back(path.back() + heading * step);
    }
    const double radius = size * random.uniform(0.02, 0.06);
    add_bar(assembly.of(random.below(3) == 0 ? Stuff::copper : any_paint(random)), path, radius, segments_for(0.05 * size, detail));
}

// A few small loose things that lie close together.
void add_loose_parts(Assembly& assembly, const Pose& place, double size, double detail, Random& random) {
    const uint32_t count = 3 + random.below(10);
    for (uint32_t i = 0; i < count; i++) {
        const double distance = size * random.uniform(0.1, 0.7);
        const Vector offset = random.direction() * distance;
        const double turn = random.uniform();
        const Pose own = Pose::along(place.origin + offset, random.direction(), turn);
        const double part = size * random.uniform(0.05, 0.25);
        const uint32_t segments = segments_for(part, detail);
        switch (random.below(5)) {
            case 0:
                add_bolt(assembly.of(any_metal(random)), own, 0.3 * part, 2 * part, segments, scaled(5, detail, 2));
                break;
            case 1:
                add_torus(assembly.of(random.below(3) == 0 ? Stuff::glass : any_metal(random)), own, part, 0.3 * part, segments,
                          std::max(3u, segments / 2));
                break;
            case 2:
                add_ball(assembly.of(random.below(3) == 0 ? Stuff::glass : Stuff::chrome), own, 0.6 * part, segments);
                break;
            case 3:
                add_pipe(assembly.of(any_metal(random)), own, 0.6 * part, 0.2 * part, 0.5 * part, 6);
                break;
            default: {
                const uint32_t teeth = 12 + random.below(12);
                add_gear(assembly.of(any_metal(random)), own, part, teeth, 0.4 * part, 0.3 * part, scaled(2, detail, 1));
                break;
            }
        }
    }
}

}  // namespace

uint64_t Assembly::triangles() const {
    uint64_t sum = 0;
    for (const TriangleMesh& mesh : meshes) sum += mesh.triangles.size();
    return sum;
}

void Assembly::clear() {
    for (TriangleMesh& mesh : meshes) {
        mesh.positions.clear();
        mesh.triangles.clear();
    }
}

uint32_t segments_for(double radius, double detail) { return static_cast<uint32_t>(std::clamp(detail * (9 + 30 * std::sqrt(radius)), 5.0, 1024.0)); }

void add_random_assembly(Assembly& assembly, const Pose& place, double size, double detail, Random& random) {
    switch (random.below(10)) {
        case 0:
        case 1:
            return add_flanged_pipe(assembly, place, size, detail, random);
        case 2:
            return add_gear_shaft(assembly, place, size, detail, random);
        case 3:
            return add_bolted_plate(assembly, place, size, detail, random);
        case 4:
            return add_strut(assembly, place, size, detail, random);
        case 5:
            return add_hose(assembly, place, size, detail, random);
        case 6:
            return add_beam(assembly.of(any_paint(random)), place, 0.1 * size, 0.15 * size, 2.2 * size);
        default:
            return add_loose_parts(assembly, place, size, detail, random);
    }
}

}  // namespace raypager
