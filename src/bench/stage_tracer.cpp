#include "bench/stage_tracer.hpp"

#include <fmt/format.h>

#include <cmath>

#include "base/check.hpp"
#include "raypager/abi/film.h"
#include "raypager/abi/path.h"
#include "scene/octahedral.hpp"

namespace raypager::bench {
Result<std::unique_ptr<StageTracer>> StageTracer::create(const BlockFile& file, const std::string& device_name, uint64_t memory_limit,
                                                         const ProfileChanges& tuning, Traversal traversal, uint64_t max_rays) {
    std::unique_ptr<StageTracer> tracer(new StageTracer);
    auto device = Device::open(device_name, memory_limit, tuning);
    if (!device) return device.status();
    tracer->device_ = std::move(*device);
    RAYPAGER_TRY(check_traversal(traversal, tracer->device_->info(), file.scene().instance_levels()));
    const BlockForm form = tracer->form_ = block_form(traversal, tracer->device_->info(), file.scene().instance_levels());
    ResidencySettings settings;
    settings.form = form;
    settings.pool_bytes =
        pool_for_all(file.scene().memory_bytes(form), tracer->device_->info().max_allocation_bytes, file.scene().largest_pageable(form));
    settings.policy = default_settings(PolicyKind::lru);
    auto residency = Residency::create(*tracer->device_, file, settings);
    if (!residency) return residency.status();
    tracer->residency_ = std::move(*residency);
    RAYPAGER_TRY(tracer->residency_->load_all(tracer->device_->kernels()));
    auto geometry =
        GeometryBuffers::create(*tracer->device_, file.scene(), form, tracer->residency_->slabs(), tracer->residency_->page_table(), false);
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
        {tracer->connect_, "connect", profile.any_hit_registers, states}};
    if (tracer->persistent_)
        parts.push_back({tracer->extend_bounces_, "extend", profile.closest_hit_registers, states + tracer->device_->bounce_definitions()});
    for (const Part& part : parts) {
        auto kernel = tracer->device_->kernel(tracer->geometry_->kernel_name(*tracer->device_, part.stage, part.registers, part.definitions));
        if (!kernel) return kernel.status();
        part.kernel = std::move(*kernel);
    }
    RAYPAGER_TRY(tracer->make_slots(static_cast<uint32_t>(max_rays)));
    return tracer;
}

Status StageTracer::make_slots(uint32_t count) {
    for (PathSlots* slots : {&slots_, &kept_slots_}) {
        auto made =
            PathSlots::create(*device_, count, form_,
                              {.vertex_colors = true, .uvs = true, .tangents = true, .instance_levels = RP_INSTANCE_MAX_LEVELS, .traits = true});
        if (!made) return made.status();
        *slots = std::move(*made);
    }
    struct Part {
        Buffer& buffer;
        uint64_t bytes;
    };
    const Part parts[] = {{queue_, uint64_t{count} * sizeof(uint32_t)},
                          {counters_, RP_COUNTER_WORDS * sizeof(uint32_t)},
                          {film_, RP_FILM_WORDS * sizeof(uint32_t)},
                          {kept_counters_, RP_COUNTER_WORDS * sizeof(uint32_t)},
                          {ranges_, sizeof(rp_primitive_range)}};
    for (const Part& part : parts) {
        auto buffer = device_->allocate(part.bytes, "rays to be measured");
        if (!buffer) return buffer.status();
        part.buffer = std::move(*buffer);
    }
    rp_render_params params = {};
    params.max_luminance = params.max_xyz = INFINITY;
    auto uploaded = device_->upload(std::as_bytes(std::span(&params, 1)), "rays to be measured");
    if (!uploaded) return uploaded.status();
    params_ = std::move(*uploaded);
    return {};
}

Status StageTracer::fill(const std::vector<Ray>& rays, RayPurpose purpose) {
    Queue& queue = device_->kernels();
    RAYPAGER_CHECK(rays.size() <= slots_.count());
    count_ = rays.size();
    purpose_ = purpose;
    const bool shadow = purpose == RayPurpose::shadow;
    // Extension rays have no end.
    for (const Ray& ray : rays) RAYPAGER_CHECK(shadow || std::isinf(ray.t_max));
    // As a render has them.
    const bool camera = purpose == RayPurpose::camera && form_ == BlockForm::stored;
    RAYPAGER_TRY(slots_.write_rays(queue, rays, shadow ? SlotRayKind::shadow : camera ? SlotRayKind::camera : SlotRayKind::extension));
    // The queue of shadow rays is read from its end (kernels/common/queue.cl).
    std::vector<uint32_t> words(slots_.count());
    for (size_t i = 0; i < words.size(); i++) words[shadow ? words.size() - 1 - i : i] = static_cast<uint32_t>(i);
    RAYPAGER_TRY(queue.write_now(queue_, 0, std::as_bytes(std::span(words))));
    std::vector<uint32_t> counters(RP_COUNTER_WORDS);
    counters[shadow ? RP_COUNT_SHADOW : RP_COUNT_EXTEND] = static_cast<uint32_t>(count_);
    return queue.write_now(counters_, 0, std::as_bytes(std::span(counters)));
}

Status StageTracer::keep() {
    RAYPAGER_TRY(slots_.copy_to(device_->kernels(), kept_slots_));
    return device_->kernels().copy(counters_, kept_counters_);
}

Status StageTracer::again() {
    RAYPAGER_TRY(kept_slots_.copy_to(device_->kernels(), slots_));
    return device_->kernels().copy(kept_counters_, counters_);
}

Result<double> StageTracer::trace() {
    const uint32_t slots = slots_.count();
    const bool shadow = purpose_ == RayPurpose::shadow;
    const bool persistent = persistent_ && (purpose_ == RayPurpose::camera || purpose_ == RayPurpose::bounce);
    Kernel& kernel = shadow                                         ? connect_
                     : purpose_ == RayPurpose::surfaces             ? extend_surfaces_
                     : persistent && purpose_ == RayPurpose::bounce ? extend_bounces_
                                                                    : extend_;
    round_++;
    RAYPAGER_TRY(shadow ? geometry_->set(kernel, round_, slots, queue_, slots_.status(), slots_.planes(), counters_, params_, ranges_, film_)
                        : geometry_->set(kernel, round_, slots, queue_, slots_.status(), slots_.planes(), counters_));
    Event event;
    if (persistent)
        RAYPAGER_TRY(device_->kernels().launch(kernel, std::min<uint64_t>(count_, device_->persistent_items()), device_->group_size(), &event));
    else
        RAYPAGER_TRY(geometry_->launch(*device_, device_->kernels(), kernel, count_, &event));
    RAYPAGER_TRY(event.wait());
    return static_cast<double>(event.duration_ns()) * 1e-9;
}

Status StageTracer::hits(std::vector<SurfacePoint>& hits) {
    RAYPAGER_CHECK(purpose_ == RayPurpose::surfaces);
    std::vector<SlotHit> found;
    RAYPAGER_TRY(slots_.read_hits(device_->kernels(), count_, found));
    hits.assign(count_, {});
    for (size_t i = 0; i < count_; i++)
        if (found[i].primitive != RP_NONE) hits[i] = {true, found[i].position, decode_octahedral(found[i].normal), found[i].primitive, found[i].t};
    return {};
}

Status StageTracer::distances(std::vector<float>& distances) {
    RAYPAGER_CHECK(purpose_ != RayPurpose::shadow);
    return slots_.read_distances(device_->kernels(), count_, distances);
}

Status StageTracer::blocked(std::vector<bool>& blocked) {
    RAYPAGER_CHECK(purpose_ == RayPurpose::shadow);
    return slots_.read_occluded(device_->kernels(), count_, blocked);
}

}  // namespace raypager::bench
