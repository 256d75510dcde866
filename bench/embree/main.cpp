// The engine's tracing stages against Embree's three interfaces, on the same rays, in one process, interleaved.
//   raypager-embree FILE.rpb [--size WxH] [--camera ...] [--light BOX] [--repeats N] [--traversal auto|ray|stream]
// Times are processor time of the whole process, so that other programs on the machine disturb little; both sides use all cores.
// Ours holds everything that a stage does: reading rays from path slots, the top tree and the hops between blocks, surfaces at hits
// (in streams; single rays leave them to shading), writing back. Embree's holds filling its ray structures and reading the hit, nothing of the
// surface.
#include <fmt/format.h>
#include <time.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "bench/stage_tracer.hpp"
#include "cli/traverse_options.hpp"
#include "embree_tracer.hpp"

namespace raypager::bench {
namespace {

double processor_seconds() {
    timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

double median(std::vector<double> values) {
    std::sort(values.begin(), values.end());
    return values[values.size() / 2];
}

struct Comparison {
    double ours = 0;
    std::array<double, 3> embree{};  // by EmbreeInterface
    uint64_t rays = 0, hits = 0, agree = 0;
    double best() const { return *std::min_element(embree.begin(), embree.end()); }
};

// Closest hits agree if both miss, or both hit at nearly the same distance (Embree's default test is not watertight).
bool agree(const SurfacePoint& ours, const SurfacePoint& embree) {
    if (!ours.hit || !embree.hit) return ours.hit == embree.hit;
    return std::abs(ours.t - embree.t) <= 1e-4f * std::abs(embree.t);
}

Result<Comparison> compare(StageTracer& tracer, const EmbreeTracer& embree, const std::vector<Ray>& rays, RayPurpose purpose, uint32_t repeats,
                           std::vector<SurfacePoint>& ours) {
    const bool shadow = purpose == RayPurpose::shadow;
    std::vector<double> our_seconds;
    std::array<std::vector<double>, 3> seconds;
    std::vector<SurfacePoint> theirs;
    for (uint32_t repeat = 0; repeat < repeats; repeat++) {
        RAYPAGER_TRY(tracer.fill(rays, purpose));
        double begin = processor_seconds();
        const auto traced = tracer.trace();
        if (!traced) return traced.status();
        our_seconds.push_back(processor_seconds() - begin);
        for (const auto interface : {EmbreeInterface::packet, EmbreeInterface::stream, EmbreeInterface::single}) {
            begin = processor_seconds();
            embree.trace(rays, shadow, purpose == RayPurpose::camera, interface, theirs);
            seconds[static_cast<size_t>(interface)].push_back(processor_seconds() - begin);
        }
    }
    Comparison result;
    result.ours = median(our_seconds);
    for (size_t i = 0; i < 3; i++) result.embree[i] = median(seconds[i]);
    result.rays = rays.size();
    if (shadow) {
        std::vector<bool> blocked;
        RAYPAGER_TRY(tracer.blocked(blocked));
        for (size_t i = 0; i < rays.size(); i++) {
            result.hits += blocked[i];
            result.agree += blocked[i] == theirs[i].hit;
        }
        return result;
    }
    RAYPAGER_TRY(tracer.fill(rays, RayPurpose::surfaces));
    if (const auto traced = tracer.trace(); !traced) return traced.status();
    RAYPAGER_TRY(tracer.hits(ours));
    for (size_t i = 0; i < rays.size(); i++) {
        result.hits += ours[i].hit;
        result.agree += agree(ours[i], theirs[i]);
    }
    return result;
}

void print(const char* name, const Comparison& c) {
    const auto rate = [&](double seconds) { return static_cast<double>(c.rays) / seconds * 1e-6; };
    fmt::print("{:<8} {:>9} {:>9} {:>8.2f} {:>8.2f} {:>8.2f} {:>8.2f} {:>7.3f} {:>10.7f}\n", name, c.rays, c.hits, rate(c.ours), rate(c.embree[0]),
               rate(c.embree[1]), rate(c.embree[2]), c.best() / c.ours, static_cast<double>(c.agree) / static_cast<double>(c.rays));
    std::fflush(stdout);
}

Status run(const std::string& input, TraverseOptions options) {
    const auto file = BlockFile::open(input);
    if (!file) return file.status();
    const BakedScene& scene = (*file)->scene();
    auto tracer = StageTracer::create(**file, options.device, options.memory_limit, options.tuning, options.traversal,
                                      uint64_t{options.width} * options.height);
    if (!tracer) return tracer.status();
    const auto embree = EmbreeTracer::create(**file);
    if (!embree) return embree.status();
    const auto each = [&](uint64_t bytes) { return static_cast<double>(bytes) / static_cast<double>(scene.triangles); };
    fmt::print("{}: {} triangles; {:.1f} bytes each against {:.1f}\n", (*tracer)->device().info().name, scene.triangles,
               each(scene.geometry_bytes((*tracer)->form())), each((*embree)->bytes()));
    fmt::print("Mrays a second of processor time\n{:<8} {:>9} {:>9} {:>8} {:>8} {:>8} {:>8} {:>7} {:>10}\n", "rays", "number", "that hit", "ours",
               "single", "packet", "stream", "ratio", "agreement");
    std::vector<Ray> primary = primary_rays(options.camera.value_or(scene.camera), options.width, options.height);
    std::vector<SurfacePoint> hits, unused;
    const auto light = options.light.value_or(default_light(scene));
    auto first = compare(**tracer, **embree, primary, RayPurpose::camera, options.repeats, hits);
    if (!first) return first.status();
    print("primary", *first);
    if (options.ceiling) end_at_ceiling(primary, hits, options.ceiling->first, options.ceiling->second, 3);
    auto second = compare(**tracer, **embree, diffuse_rays(primary, hits, 1), RayPurpose::bounce, options.repeats, unused);
    if (!second) return second.status();
    print("diffuse", *second);
    auto third = compare(**tracer, **embree, shadow_rays(primary, hits, light.first, light.second, 2), RayPurpose::shadow, options.repeats, unused);
    if (!third) return third.status();
    print("shadow", *third);
    const double product = first->best() / first->ours * second->best() / second->ours * third->best() / third->ours;
    fmt::print("geometric mean of the ratios to Embree's best interface: {:.3f}\n", std::cbrt(product));
    return {};
}

Status main_of(const Arguments& arguments) {
    TraverseSettings settings;
    OptionParser parser("raypager-embree", "FILE.rpb [options]", "Compares the engine's tracing stages on a CPU with Embree.");
    add_traverse_options(parser, settings);
    const auto outcome = parser.parse(arguments);
    if (!outcome) return outcome.status();
    if (*outcome == OptionParser::Outcome::help_shown) return {};
    return run(settings.inputs.front(), traverse_options(settings));
}

}  // namespace
}  // namespace raypager::bench

int main(int argc, char** argv) {
    const raypager::Status status = raypager::bench::main_of({argv + 1, argv + argc});
    if (status.ok()) return 0;
    fmt::print(stderr, "raypager-embree: {}\n", status.message());
    return status.exit_code();
}
