#include "bench/traverse.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "bench/stage_tracer.hpp"

namespace raypager::bench {
namespace {

// Traces rays to their closest hits as often as asked. bounces: with the kernel that a render uses for them, where the device has one of
// its own.
Result<RaySetResult> closest(StageTracer& tracer, const std::string& name, const std::vector<Ray>& rays, bool bounces, uint32_t repeats,
                             std::vector<SurfacePoint>& hits) {
    RaySetResult result{name, rays.size(), 0, {}};
    RAYPAGER_TRY(tracer.fill(rays, bounces ? RayPurpose::bounce : RayPurpose::camera));
    RAYPAGER_TRY(tracer.keep());
    for (uint32_t repeat = 0; repeat < repeats; repeat++) {
        RAYPAGER_TRY(tracer.again());
        const auto seconds = tracer.trace();
        if (!seconds) return seconds.status();
        result.seconds.push_back(*seconds);
    }
    std::vector<float> measured, distances;
    RAYPAGER_TRY(tracer.distances(measured));
    RAYPAGER_TRY(tracer.fill(rays, RayPurpose::surfaces));
    if (const auto traced = tracer.trace(); !traced) return traced.status();
    RAYPAGER_TRY(tracer.hits(hits));
    RAYPAGER_TRY(tracer.distances(distances));
    if (measured != distances) return Status::failed("the kernel that was measured has found other hits than the one that finds surfaces as well");
    for (const SurfacePoint& hit : hits) result.hits += hit.hit;
    return result;
}

// Asks for any hit.
Result<RaySetResult> any(StageTracer& tracer, const std::string& name, const std::vector<Ray>& rays, uint32_t repeats) {
    RaySetResult result{name, rays.size(), 0, {}};
    RAYPAGER_TRY(tracer.fill(rays, RayPurpose::shadow));
    RAYPAGER_TRY(tracer.keep());
    for (uint32_t repeat = 0; repeat < repeats; repeat++) {
        RAYPAGER_TRY(tracer.again());
        const auto seconds = tracer.trace();
        if (!seconds) return seconds.status();
        result.seconds.push_back(*seconds);
    }
    std::vector<bool> blocked;
    RAYPAGER_TRY(tracer.blocked(blocked));
    result.hits = static_cast<uint64_t>(std::count(blocked.begin(), blocked.end(), true));
    return result;
}

}  // namespace

// Above the scene, where a sun or a lamp would be.
std::pair<Float3, Float3> default_light(const BakedScene& scene) {
    const auto at = [&](int axis, float share) { return scene.lower[axis] + share * (scene.upper[axis] - scene.lower[axis]); };
    const float top = at(1, 1.0f) + (scene.upper[0] - scene.lower[0]) / 2;
    return {{at(0, 0.2f), top, at(2, 0.2f)}, {at(0, 0.4f), top, at(2, 0.4f)}};
}

double RaySetResult::median_seconds() const {
    std::vector<double> sorted = seconds;
    std::sort(sorted.begin(), sorted.end());
    return sorted.empty() ? std::numeric_limits<double>::quiet_NaN() : sorted[sorted.size() / 2];
}

Result<TraverseResult> measure_traversal(const BlockFile& file, const TraverseOptions& options) {
    auto tracer =
        StageTracer::create(file, options.device, options.memory_limit, options.tuning, options.traversal, uint64_t{options.width} * options.height);
    if (!tracer) return tracer.status();
    const BakedScene& scene = file.scene();
    TraverseResult result;
    result.device = (*tracer)->device().info().name;
    result.bytes_per_primitive =
        static_cast<double>(scene.geometry_bytes((*tracer)->form())) / static_cast<double>(std::max<uint64_t>(1, scene.triangles + scene.spheres));
    std::vector<Ray> primary = primary_rays(options.camera.value_or(scene.camera), options.width, options.height);
    std::vector<SurfacePoint> hits, unused;
    auto set = closest(**tracer, "primary", primary, false, options.repeats, hits);
    if (!set) return set.status();
    result.sets.push_back(*set);
    if (set->hits == 0) return Status::failed("no camera ray meets the scene; give a --camera that looks at it");
    if (options.ceiling) end_at_ceiling(primary, hits, options.ceiling->first, options.ceiling->second, 3);
    set = closest(**tracer, "diffuse", diffuse_rays(primary, hits, 1), true, options.repeats, unused);
    if (!set) return set.status();
    result.sets.push_back(*set);
    const auto light = options.light.value_or(default_light(scene));
    set = any(**tracer, "shadow", shadow_rays(primary, hits, light.first, light.second, 2), options.repeats);
    if (!set) return set.status();
    result.sets.push_back(*set);
    return result;
}

}  // namespace raypager::bench
