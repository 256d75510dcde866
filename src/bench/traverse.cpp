#include "bench/traverse.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "bench/ray_sets.hpp"
#include "blocks/octahedral.hpp"
#include "device/device.hpp"
#include "raypager/abi/film.h"
#include "raypager/abi/path.h"
#include "residency/residency.hpp"
#include "wavefront/geometry_buffers.hpp"

namespace raypager::bench {
namespace {

struct Word4 {
    uint32_t x, y, z, w;
};

uint32_t bits(float v) { return std::bit_cast<uint32_t>(v); }
float number(uint32_t v) { return std::bit_cast<float>(v); }

// A scene on the device with path slots that can be filled with any rays.
class Bench {
public:
    static Result<std::unique_ptr<Bench>> create(const BlockFile& file, const TraverseOptions& options);
    const Device& device() const { return *device_; }

    // Traces rays to their closest hits as often as asked.
    // bounces: with the kernel that a render uses for them, where the device has one of its own.
    Result<RaySetResult> closest(const std::string& name, const std::vector<Ray>& rays, bool bounces, uint32_t repeats,
                                 std::vector<SurfacePoint>& hits);
    // Asks for any hit.
    Result<RaySetResult> any(const std::string& name, const std::vector<Ray>& rays, uint32_t repeats);

private:
    Status make_slots(uint64_t count);
    Status fill(const std::vector<Ray>& rays, bool shadow);
    Status time(const Kernel& kernel, uint64_t items, RaySetResult& result);
    Status read_plane(uint32_t plane, size_t count, std::vector<Word4>& values);

    std::unique_ptr<Device> device_;
    std::unique_ptr<Residency> residency_;
    std::unique_ptr<GeometryBuffers> geometry_;
    Kernel extend_, extend_persistent_, connect_;
    uint64_t slots_ = 0;
    Buffer status_, paths_, queue_, counters_, film_;
};

Result<std::unique_ptr<Bench>> Bench::create(const BlockFile& file, const TraverseOptions& options) {
    std::unique_ptr<Bench> bench(new Bench);
    auto device = Device::open(options.device, options.memory_limit);
    if (!device) return device.status();
    bench->device_ = std::move(*device);
    ResidencySettings settings;
    settings.pool_bytes = file.scene().geometry_bytes();
    settings.policy = default_settings(PolicyKind::lru);
    auto residency = Residency::create(*bench->device_, file, settings);
    if (!residency) return residency.status();
    bench->residency_ = std::move(*residency);
    RAYPAGER_TRY(bench->residency_->load_all(bench->device_->kernels()));
    auto geometry = GeometryBuffers::create(*bench->device_, file.scene(), bench->residency_->slabs(), bench->residency_->page_table());
    if (!geometry) return geometry.status();
    bench->geometry_ = std::make_unique<GeometryBuffers>(std::move(*geometry));
    auto extend = bench->device_->kernel("extend", "rp_extend", bench->geometry_->definitions());
    if (!extend) return extend.status();
    bench->extend_ = std::move(*extend);
    if (const uint32_t lanes = bench->device_->persistent_lanes()) {
        extend = bench->device_->kernel("extend", "rp_extend", bench->geometry_->definitions() + fmt::format(" -DRP_PERSISTENT={}", lanes));
        if (!extend) return extend.status();
        bench->extend_persistent_ = std::move(*extend);
    }
    auto connect = bench->device_->kernel("connect", "rp_connect", bench->geometry_->definitions());
    if (!connect) return connect.status();
    bench->connect_ = std::move(*connect);
    RAYPAGER_TRY(bench->make_slots(uint64_t{options.width} * options.height));
    return bench;
}

Status Bench::make_slots(uint64_t count) {
    slots_ = count;
    struct Part {
        Buffer& buffer;
        uint64_t bytes;
    };
    const Part parts[] = {{status_, count * sizeof(uint32_t)},
                          {paths_, count * RP_PATH_PLANES * sizeof(Word4)},
                          {queue_, count * sizeof(uint32_t)},
                          {counters_, RP_COUNTER_WORDS * sizeof(uint32_t)},
                          {film_, RP_FILM_WORDS * sizeof(uint32_t)}};
    for (const Part& part : parts) {
        auto buffer = device_->allocate(part.bytes, "rays to be measured");
        if (!buffer) return buffer.status();
        part.buffer = std::move(*buffer);
    }
    return {};
}

// Ray i goes into slot i.
Status Bench::fill(const std::vector<Ray>& rays, bool shadow) {
    Queue& queue = device_->kernels();
    const size_t count = rays.size();
    std::vector<Word4> plane(count);
    const auto write = [&](uint32_t index, auto value) {
        for (size_t i = 0; i < count; i++) plane[i] = value(rays[i]);
        return queue.write_now(paths_, index * slots_ * sizeof(Word4), bytes_of(plane));
    };
    RAYPAGER_TRY(write(RP_PLANE_ORIGIN, [](const Ray& r) { return Word4{bits(r.origin.x), bits(r.origin.y), bits(r.origin.z), bits(r.t_max)}; }));
    RAYPAGER_TRY(write(RP_PLANE_DIRECTION, [](const Ray& r) { return Word4{bits(r.direction.x), bits(r.direction.y), bits(r.direction.z), 0}; }));
    RAYPAGER_TRY(write(RP_PLANE_THROUGHPUT, [](const Ray&) { return Word4{}; }));
    RAYPAGER_TRY(write(RP_PLANE_RADIANCE, [](const Ray&) { return Word4{}; }));
    // A shadow ray that arrives adds (1, 0, 0) to the radiance.
    RAYPAGER_TRY(write(RP_PLANE_HIT, [&](const Ray&) { return Word4{0, 0, 0, shadow ? bits(1.0f) : RP_NONE}; }));
    RAYPAGER_TRY(write(RP_PLANE_SURFACE, [](const Ray&) { return Word4{0, 0, 0, RP_NONE}; }));
    std::vector<uint32_t> words(count, shadow ? RP_STATUS_SHADOW : RP_STATUS_EXTEND);
    RAYPAGER_TRY(queue.write_now(status_, 0, bytes_of(words)));
    // The queue of shadow rays is read from its end (kernels/lib/path.cl).
    words.resize(slots_);
    for (size_t i = 0; i < slots_; i++) words[shadow ? slots_ - 1 - i : i] = static_cast<uint32_t>(i);
    RAYPAGER_TRY(queue.write_now(queue_, 0, bytes_of(words)));
    std::vector<uint32_t> counters(RP_COUNTER_WORDS);
    counters[shadow ? RP_COUNT_SHADOW : RP_COUNT_EXTEND] = static_cast<uint32_t>(count);
    return queue.write_now(counters_, 0, bytes_of(counters));
}

Status Bench::time(const Kernel& kernel, uint64_t items, RaySetResult& result) {
    Event event;
    RAYPAGER_TRY(device_->kernels().launch(kernel, items, device_->group_size(), &event));
    RAYPAGER_TRY(event.wait());
    result.seconds.push_back(static_cast<double>(event.duration_ns()) * 1e-9);
    return {};
}

Status Bench::read_plane(uint32_t plane, size_t count, std::vector<Word4>& values) {
    values.resize(count);
    return device_->kernels().read_now(paths_, plane * slots_ * sizeof(Word4), std::as_writable_bytes(std::span(values)));
}

Result<RaySetResult> Bench::closest(const std::string& name, const std::vector<Ray>& rays, bool bounces, uint32_t repeats,
                                    std::vector<SurfacePoint>& hits) {
    const bool persistent = bounces && device_->persistent_lanes();
    Kernel& kernel = persistent ? extend_persistent_ : extend_;
    const uint64_t items = persistent ? std::min<uint64_t>(rays.size(), device_->persistent_items()) : rays.size();
    RaySetResult result{name, rays.size(), 0, {}};
    const auto slots = static_cast<uint32_t>(slots_);
    for (uint32_t repeat = 0; repeat < repeats; repeat++) {
        RAYPAGER_TRY(fill(rays, false));
        RAYPAGER_TRY(geometry_->set(kernel, repeat + 1, slots, queue_, status_, paths_, counters_));
        RAYPAGER_TRY(time(kernel, items, result));
    }
    std::vector<Word4> origin, hit, surface;
    RAYPAGER_TRY(read_plane(RP_PLANE_ORIGIN, rays.size(), origin));
    RAYPAGER_TRY(read_plane(RP_PLANE_HIT, rays.size(), hit));
    RAYPAGER_TRY(read_plane(RP_PLANE_SURFACE, rays.size(), surface));
    hits.assign(rays.size(), {});
    for (size_t i = 0; i < rays.size(); i++) {
        if (hit[i].w == RP_NONE) continue;
        hits[i] = {true, {number(hit[i].x), number(hit[i].y), number(hit[i].z)}, decode_octahedral(surface[i].x), hit[i].w, number(origin[i].w)};
        result.hits++;
    }
    return result;
}

Result<RaySetResult> Bench::any(const std::string& name, const std::vector<Ray>& rays, uint32_t repeats) {
    RaySetResult result{name, rays.size(), 0, {}};
    const auto slots = static_cast<uint32_t>(slots_);
    for (uint32_t repeat = 0; repeat < repeats; repeat++) {
        RAYPAGER_TRY(fill(rays, true));
        RAYPAGER_TRY(geometry_->set(connect_, repeat + 1, slots, queue_, status_, paths_, counters_, film_));
        RAYPAGER_TRY(time(connect_, rays.size(), result));
    }
    std::vector<Word4> radiance;
    RAYPAGER_TRY(read_plane(RP_PLANE_RADIANCE, rays.size(), radiance));
    for (const Word4& value : radiance) result.hits += value.x == 0;
    return result;
}

// Above the scene, where a sun or a lamp would be.
std::pair<Float3, Float3> default_light(const BakedScene& scene) {
    const auto at = [&](int axis, float share) { return scene.lower[axis] + share * (scene.upper[axis] - scene.lower[axis]); };
    const float top = at(1, 1.0f) + (scene.upper[0] - scene.lower[0]) / 2;
    return {{at(0, 0.2f), top, at(2, 0.2f)}, {at(0, 0.4f), top, at(2, 0.4f)}};
}

}  // namespace

double RaySetResult::median_seconds() const {
    std::vector<double> sorted = seconds;
    std::sort(sorted.begin(), sorted.end());
    return sorted.empty() ? std::numeric_limits<double>::quiet_NaN() : sorted[sorted.size() / 2];
}

Result<TraverseResult> measure_traversal(const BlockFile& file, const TraverseOptions& options) {
    auto bench = Bench::create(file, options);
    if (!bench) return bench.status();
    const BakedScene& scene = file.scene();
    TraverseResult result;
    result.device = (*bench)->device().info().name;
    result.bytes_per_primitive =
        static_cast<double>(scene.geometry_bytes()) / static_cast<double>(std::max<uint64_t>(1, scene.triangles + scene.spheres));
    const std::vector<Ray> primary = primary_rays(options.camera.value_or(scene.camera), options.width, options.height);
    std::vector<SurfacePoint> hits, unused;
    auto set = (*bench)->closest("primary", primary, false, options.repeats, hits);
    if (!set) return set.status();
    result.sets.push_back(*set);
    if (set->hits == 0) return Status::failed("no camera ray meets the scene; give a --camera that looks at it");
    set = (*bench)->closest("diffuse", diffuse_rays(primary, hits, 1), true, options.repeats, unused);
    if (!set) return set.status();
    result.sets.push_back(*set);
    const auto light = options.light.value_or(default_light(scene));
    set = (*bench)->any("shadow", shadow_rays(primary, hits, light.first, light.second, 2), options.repeats);
    if (!set) return set.status();
    result.sets.push_back(*set);
    return result;
}

}  // namespace raypager::bench
