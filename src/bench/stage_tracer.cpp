#include "bench/stage_tracer.hpp"

#include <fmt/format.h>

#include <bit>
#include <cmath>

#include "base/check.hpp"
#include "base/parallel.hpp"
#include "blocks/octahedral.hpp"
#include "raypager/abi/film.h"
#include "raypager/abi/path.h"

namespace raypager::bench {
namespace {

uint32_t bits(float v) { return std::bit_cast<uint32_t>(v); }
float number(uint32_t v) { return std::bit_cast<float>(v); }

}  // namespace

Result<std::unique_ptr<StageTracer>> StageTracer::create(const BlockFile& file, const std::string& device_name, uint64_t memory_limit,
                                                         const ProfileChanges& tuning, Traversal traversal, uint64_t most_rays) {
    std::unique_ptr<StageTracer> tracer(new StageTracer);
    auto device = Device::open(device_name, memory_limit, tuning);
    if (!device) return device.status();
    tracer->device_ = std::move(*device);
    RAYPAGER_TRY(check_traversal(traversal, tracer->device_->info()));
    const BlockForm form = tracer->form_ = block_form(traversal, tracer->device_->info());
    ResidencySettings settings;
    settings.form = form;
    settings.pool_bytes =
        pool_for_all(file.scene().geometry_bytes(form), tracer->device_->info().max_allocation_bytes, file.scene().largest_block(form));
    settings.policy = default_settings(PolicyKind::lru);
    auto residency = Residency::create(*tracer->device_, file, settings);
    if (!residency) return residency.status();
    tracer->residency_ = std::move(*residency);
    RAYPAGER_TRY(tracer->residency_->load_all(tracer->device_->kernels()));
    auto geometry = GeometryBuffers::create(*tracer->device_, file.scene(), form, tracer->residency_->slabs(), tracer->residency_->page_table());
    if (!geometry) return geometry.status();
    tracer->geometry_ = std::make_unique<GeometryBuffers>(std::move(*geometry));
    struct Part {
        Kernel& kernel;
        const char* stage;
        uint32_t registers;
        std::string definitions;
    };
    const bool stored = form == BlockForm::stored;
    tracer->persistent_ = stored && tracer->device_->has_persistent_threads();
    const std::string states = stored ? short_states : "";
    const DeviceProfile& profile = tracer->device_->profile();
    std::vector<Part> parts = {
        {tracer->extend_, "extend", profile.closest_hit_registers, states + (tracer->persistent_ ? tracer->device_->camera_definitions() : "")},
        {tracer->extend_surfaces_, "extend", profile.closest_hit_registers, ""},
        {tracer->connect_, "connect", profile.any_hit_registers, ""}};
    if (tracer->persistent_)
        parts.push_back({tracer->extend_bounces_, "extend", profile.closest_hit_registers, states + tracer->device_->bounce_definitions()});
    for (const Part& part : parts) {
        auto kernel = tracer->geometry_->kernel(*tracer->device_, part.stage, part.registers, part.definitions);
        if (!kernel) return kernel.status();
        part.kernel = std::move(*kernel);
    }
    RAYPAGER_TRY(tracer->make_slots(most_rays));
    return tracer;
}

Status StageTracer::make_slots(uint64_t count) {
    slots_ = count;
    struct Part {
        Buffer& buffer;
        uint64_t bytes;
    };
    const Part parts[] = {{status_, 3 * RP_STATUS_WORDS(count) * sizeof(uint32_t)},
                          {paths_, count * RP_PATH_PLANES * sizeof(Word4)},
                          {queue_, count * sizeof(uint32_t)},
                          {counters_, RP_COUNTER_WORDS * sizeof(uint32_t)},
                          {film_, RP_FILM_WORDS * sizeof(uint32_t)},
                          {kept_status_, 3 * RP_STATUS_WORDS(count) * sizeof(uint32_t)},
                          {kept_paths_, count * RP_PATH_PLANES * sizeof(Word4)},
                          {kept_counters_, RP_COUNTER_WORDS * sizeof(uint32_t)}};
    for (const Part& part : parts) {
        auto buffer = device_->allocate(part.bytes, "rays to be measured");
        if (!buffer) return buffer.status();
        part.buffer = std::move(*buffer);
    }
    return {};
}

Status StageTracer::fill(const std::vector<Ray>& rays, RayPurpose purpose) {
    Queue& queue = device_->kernels();
    RAYPAGER_CHECK(rays.size() <= slots_);
    count_ = rays.size();
    purpose_ = purpose;
    const bool shadow = purpose == RayPurpose::shadow;
    // Extension rays have no end.
    for (const Ray& ray : rays) RAYPAGER_CHECK(shadow || std::isinf(ray.t_max));
    const size_t count = rays.size();
    pair_.resize(2 * count);
    const auto write = [&](uint32_t plane, auto even, auto odd) {
        parallel_for(count, 1 << 16, [&](size_t begin, size_t end) {
            for (size_t i = begin; i < end; i++) {
                pair_[2 * i] = even(rays[i]);
                pair_[2 * i + 1] = odd(rays[i]);
            }
        });
        return queue.write_now(paths_, RP_PLANE_INDEX(plane, slots_, 0) * sizeof(Word4), bytes_of(pair_));
    };
    const auto zero = [](const Ray&) { return Word4{}; };
    static_assert(RP_PLANE_ORIGIN == 0 && RP_PLANE_DIRECTION == 1 && RP_PLANE_THROUGHPUT == 2 && RP_PLANE_RADIANCE == 3 && RP_PLANE_HIT == 4 &&
                  RP_PLANE_SURFACE == 5);
    RAYPAGER_TRY(write(
        RP_PLANE_ORIGIN,
        [](const Ray& r) {
            return Word4{bits(r.origin.x), bits(r.origin.y), bits(r.origin.z), bits(r.t_max)};
        },
        [](const Ray& r) {
            return Word4{bits(r.direction.x), bits(r.direction.y), bits(r.direction.z), 0};
        }));
    RAYPAGER_TRY(write(RP_PLANE_THROUGHPUT, zero, zero));
    RAYPAGER_TRY(write(
        RP_PLANE_HIT,
        [&](const Ray&) {
            return Word4{0, 0, 0, shadow ? 0 : RP_NONE};
        },
        [](const Ray&) {
            return Word4{0, 0, 0, RP_NONE};
        }));
    // As a render has them: of pixel bits(t_max), which nobody asks for, sample 0.
    const bool camera = purpose == RayPurpose::camera && form_ == BlockForm::stored;
    std::vector<uint32_t> words(count, shadow ? RP_STATUS_SHADOW : camera ? RP_STATUS_EXTEND | RP_STATUS_CAMERA : RP_STATUS_EXTEND);
    RAYPAGER_TRY(queue.write_now(status_, 0, bytes_of(words)));
    // The queue of shadow rays is read from its end (kernels/lib/path.cl).
    words.resize(slots_);
    for (size_t i = 0; i < slots_; i++) words[shadow ? slots_ - 1 - i : i] = static_cast<uint32_t>(i);
    RAYPAGER_TRY(queue.write_now(queue_, 0, bytes_of(words)));
    std::vector<uint32_t> counters(RP_COUNTER_WORDS);
    counters[shadow ? RP_COUNT_SHADOW : RP_COUNT_EXTEND] = static_cast<uint32_t>(count);
    return queue.write_now(counters_, 0, bytes_of(counters));
}

Status StageTracer::keep() {
    Queue& queue = device_->kernels();
    for (const auto& [from, to] : {std::pair{&status_, &kept_status_}, {&paths_, &kept_paths_}, {&counters_, &kept_counters_}})
        RAYPAGER_TRY(queue.copy(*from, *to));
    return {};
}

Status StageTracer::again() {
    Queue& queue = device_->kernels();
    for (const auto& [from, to] : {std::pair{&kept_status_, &status_}, {&kept_paths_, &paths_}, {&kept_counters_, &counters_}})
        RAYPAGER_TRY(queue.copy(*from, *to));
    return {};
}

Status StageTracer::read_states(std::vector<uint32_t>& states) {
    states.resize(count_);
    return device_->kernels().read_now(status_, 0, std::as_writable_bytes(std::span(states)));
}

Result<double> StageTracer::trace() {
    const auto slots = static_cast<uint32_t>(slots_);
    const bool shadow = purpose_ == RayPurpose::shadow;
    const bool persistent = persistent_ && (purpose_ == RayPurpose::camera || purpose_ == RayPurpose::bounce);
    Kernel& kernel = shadow                                         ? connect_
                     : purpose_ == RayPurpose::surfaces             ? extend_surfaces_
                     : persistent && purpose_ == RayPurpose::bounce ? extend_bounces_
                                                                    : extend_;
    round_++;
    RAYPAGER_TRY(shadow ? geometry_->set(kernel, round_, slots, queue_, status_, paths_, counters_, film_)
                        : geometry_->set(kernel, round_, slots, queue_, status_, paths_, counters_));
    Event event;
    if (persistent)
        RAYPAGER_TRY(device_->kernels().launch(kernel, std::min<uint64_t>(count_, device_->persistent_items()), device_->group_size(), &event));
    else
        RAYPAGER_TRY(geometry_->launch(*device_, device_->kernels(), kernel, count_, &event));
    RAYPAGER_TRY(event.wait());
    return static_cast<double>(event.duration_ns()) * 1e-9;
}

Status StageTracer::read_plane(uint32_t plane, std::vector<Word4>& values) {
    pair_.resize(2 * count_);
    RAYPAGER_TRY(
        device_->kernels().read_now(paths_, RP_PLANE_INDEX(plane - plane % 2, slots_, 0) * sizeof(Word4), std::as_writable_bytes(std::span(pair_))));
    values.resize(count_);
    for (size_t i = 0; i < count_; i++) values[i] = pair_[2 * i + plane % 2];
    return {};
}

Status StageTracer::hits(std::vector<SurfacePoint>& hits) {
    RAYPAGER_CHECK(purpose_ == RayPurpose::surfaces);
    std::vector<Word4> origin, hit, surface;
    RAYPAGER_TRY(read_plane(RP_PLANE_ORIGIN, origin));
    RAYPAGER_TRY(read_plane(RP_PLANE_HIT, hit));
    RAYPAGER_TRY(read_plane(RP_PLANE_SURFACE, surface));
    hits.assign(count_, {});
    for (size_t i = 0; i < count_; i++)
        if (hit[i].w != RP_NONE)
            hits[i] = {true, {number(hit[i].x), number(hit[i].y), number(hit[i].z)}, decode_octahedral(surface[i].x), hit[i].w, number(origin[i].w)};
    return {};
}

Status StageTracer::distances(std::vector<float>& distances) {
    RAYPAGER_CHECK(purpose_ != RayPurpose::shadow);
    std::vector<Word4> origin, hit;
    std::vector<uint32_t> states;
    RAYPAGER_TRY(read_plane(RP_PLANE_ORIGIN, origin));
    RAYPAGER_TRY(read_plane(RP_PLANE_HIT, hit));
    RAYPAGER_TRY(read_states(states));
    distances.clear();
    for (size_t i = 0; i < count_; i++) {
        // Beside streams these bits are of a block's number.
        const uint32_t state = form_ == BlockForm::stored ? states[i] : 0;
        const Word4& found = state & RP_STATUS_CAMERA ? origin[i] : hit[i];
        distances.push_back(number(state & RP_STATUS_FOUND ? found.z : origin[i].w));
    }
    return {};
}

Status StageTracer::blocked(std::vector<bool>& blocked) {
    RAYPAGER_CHECK(purpose_ == RayPurpose::shadow);
    blocked.clear();
    std::vector<uint32_t> states;
    RAYPAGER_TRY(read_states(states));
    for (const uint32_t state : states) blocked.push_back((state & RP_STATUS_LIT) == 0);
    return {};
}

}  // namespace raypager::bench
