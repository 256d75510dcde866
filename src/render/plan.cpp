#include "render/plan.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "base/memory.hpp"
#include "base/words.hpp"
#include "render/adaptive.hpp"
#include "render/params.hpp"
#include "wavefront/block_form.hpp"
#include "wavefront/sample_order.hpp"

namespace raypager {
namespace {

// On CPUs it is streams that gain by more rays to choose from.
uint64_t preferred_slots(BlockForm form, const DeviceProfile& profile) {
    return profile.caches_slots && form != BlockForm::wide ? 0 : profile.preferred_slots;
}

// The tiles of a render that goes on from a checkpoint are those that it began with.
bool chooses_tile(const RenderOptions& options) { return options.tuning.tile_size == 0 && options.checkpoint.file.empty(); }

bool chooses_region(const RenderOptions& options) { return !options.tuning.region && !is_seen_growing(options); }

// Of a pool that holds all blocks and pages, and what slabs leave over at their ends.
uint64_t whole_pool_bytes(const BakedScene& scene, BlockForm form, const DeviceInfo& device) {
    return pool_for_all(scene.memory_bytes(form), device.max_allocation_bytes, scene.largest_pageable(form));
}

// About instruments.record_paths of all paths, and room for what they log in an ordinary round; in others, some rays wait for the next one.
VisitLogSettings visit_log_settings(const BakedScene& scene, const RenderOptions& options, const RenderInstruments& instruments,
                                    const rp_render_params& params, const DeviceInfo& device) {
    VisitLogSettings visits;
    if (instruments.record_paths == 0) return visits;
    const double share =
        std::min(1.0, static_cast<double>(instruments.record_paths) / (static_cast<double>(params.spp) * params.width * params.height));
    const double slots = static_cast<double>(options.tuning.paths ? options.tuning.paths : device.profile.max_slots);
    visits.threshold = static_cast<uint32_t>(share * 4294967295.0);
    // What one shadow ray passes is logged together (kernels/single_ray/visits.cl).
    const double least = 256 + static_cast<double>(scene.blocks.size());
    visits.capacity = static_cast<uint32_t>(std::clamp(share * slots * 4, least, std::max(least, 4194304.0)));
    if (instruments.visit_events) visits.capacity = instruments.visit_events;
    return visits;
}

// device_limit: of all device memory, in bytes. A pool in host memory is not among the needs.
MemoryNeeds memory_needs(const BakedScene& scene, BlockForm form, const RenderOptions& options, const RenderInstruments& instruments,
                         const rp_render_params& params, const VisitLogSettings& visits, const DeviceInfo& device, uint64_t device_limit,
                         const Sharers& sharers) {
    const WavefrontBytes bytes = wavefront_bytes(scene, form, params.width, FilmLayout(params));
    MemoryNeeds needs;
    needs.limit = device_limit;
    needs.fixed = bytes.scene + std::max<uint64_t>(scene.pageable_count(), 1) * sizeof(rp_page) + RP_BLOCK_ALIGNMENT + visits.bytes();
    needs.film = bytes.film_row * params.height;
    if (may_take_windows(options, instruments, params, sharers)) needs.film_part = bytes.film_row * params.order.tile_size;
    needs.whole_film = instruments.whole_film;
    needs.max_film = device.max_allocation_bytes;
    needs.per_slot = bytes.per_slot;
    if (options.tuning.pool_place == PoolPlace::device) {
        needs.largest_block = scene.largest_pageable(form);
        needs.geometry = whole_pool_bytes(scene, form, device);
        needs.geometry_limit = options.geometry_limit;
        if (const uint64_t most = largest_pool(device.max_allocation_bytes); needs.geometry > most)
            needs.geometry_limit = options.geometry_limit ? std::min(options.geometry_limit, most) : most;
        needs.geometry_limit_percent = options.geometry_limit_percent;
    }
    needs.requested_slots = options.tuning.paths;
    const DeviceProfile& profile = device.profile;
    needs.default_slots = profile.default_slots;
    needs.preferred_slots = preferred_slots(form, profile);
    needs.max_chosen_slots = profile.max_slots;
    needs.max_slot_bytes = profile.scenes_for_slots * needs.geometry;
    needs.cached_slots = profile.caches_slots ? needs.preferred_slots : 0;
    needs.slots_for_loads = profile.loads_for_slots;
    // Of a render that ends by the clock, all that is under way then must still come to its end: a few samples a pixel.
    constexpr uint64_t few_spp = 16;
    needs.total_paths = options.time_seconds > 0 ? std::min(params.stage_begin, few_spp * params.width * params.height) : params.stage_begin;
    if (params.adaptive_error > 0 && options.time_seconds == 0)
        needs.total_paths *= std::max<uint64_t>(1, params.spp / AdaptiveSampling::first_samples);
    needs.total_paths = std::max<uint64_t>(1, needs.total_paths / sharers.all_devices);
    needs.max_region_slots = chooses_region(options) ? max_slots_with_regions(params.order, uint64_t{params.width} * params.height) : 0;
    needs.max_slots = device.max_allocation_bytes / bytes.largest_part_per_slot;
    return needs;
}

PolicySettings policy_settings(const BakedScene& scene, BlockForm form, const RenderOptions& options, const RenderInstruments& instruments,
                               uint64_t pool_bytes, const DeviceInfo& device) {
    const uint64_t average = scene.pageable_count() == 0 ? 0 : scene.memory_bytes(form) / scene.pageable_count();
    PolicySettings policy = default_settings(options.tuning.policy, pool_bytes, average, device.profile);
    if (instruments.evict_ahead) policy.evict_ahead = *instruments.evict_ahead;
    if (options.tuning.loads_in_flight) {
        policy.loads_in_flight = policy.loads_while_idle = options.tuning.loads_in_flight;
        policy.evict_ahead = std::min(policy.evict_ahead, options.tuning.loads_in_flight);
    }
    if (options.tuning.hold_above_ready) policy.hold_above_ready = *options.tuning.hold_above_ready;
    return policy;
}

}  // namespace

bool may_take_windows(const RenderOptions& options, const RenderInstruments& instruments, const rp_render_params& params, const Sharers& sharers) {
    return !options.peers && sharers.all_devices == 1 && params.adaptive_error == 0 && options.time_seconds == 0 && !options.coarse_first &&
           instruments.record_paths == 0;
}

uint64_t host_limit(const RenderOptions& options, const DeviceInfo& device, uint64_t planned_bytes, uint32_t processes, uint64_t film_bytes) {
    if (options.host_limit) return options.host_limit;
    // What such a device takes comes out of the same memory.
    const uint64_t taken = film_bytes + (device.profile.shares_host_memory ? planned_bytes : 0);
    const auto left = [taken](uint64_t memory) { return memory - std::min(memory, taken); };
    return default_limit(left(total_memory()) / 2, left(available_memory())).bytes / processes;
}

BlockNotes block_notes(PolicyKind policy) {
    return {.bounces = policy == PolicyKind::most_wanted, .use = counts_entries(policy) ? BlockNotes::Use::entries : BlockNotes::Use::last_round};
}

uint32_t chosen_region(const rp_sample_order& order, const MemoryPlan& plan, const MemoryNeeds& needs, uint64_t pixels) {
    const uint32_t region = default_region(order, plan.slots, pixels);
    if (region == 0 || holds_all(plan, needs)) return region;
    return default_region(order, std::max<uint64_t>(1, plan.slots / 2), pixels);  // the others wait
}

uint32_t filled_together(const rp_sample_order& order, const MemoryPlan& plan, const MemoryNeeds& needs) {
    if (holds_all(plan, needs)) return 8;
    return order.region == 0 ? 1 : filled_together(0.0);
}

// Measured on an H100 (bench/journal/gpu-paging.md): at 29, 12.5 and 3 % resident a ray of a terrain waits 0.04, 0.13 and 0.5 times, one among
// clutter 0.14, 0.4 and 1.5 times.
uint32_t filled_together(double waits_per_ray) { return waits_per_ray < 0.1 ? 4 : waits_per_ray < 0.6 ? 2 : 1; }

namespace {

// Whether a pool in host memory fits.
Status check_host_pool(const BakedScene& scene, BlockForm form, const RenderOptions& options, uint64_t host_limit, const DeviceInfo& device) {
    const uint64_t bytes = options.tuning.pool_place == PoolPlace::host ? whole_pool_bytes(scene, form, device) : 0;
    if (bytes <= host_limit) return {};
    return Status::failed(fmt::format("--pool host: geometry and images take {} of host memory, the limit is {}; give a larger --host-limit",
                                      format_exact_bytes(bytes), format_bytes(host_limit)));
}

ResidencySettings plan_residency(const BakedScene& scene, const RenderOptions& options, const RenderInstruments& instruments, const RenderPlan& plan,
                                 uint64_t pool_bytes, const DeviceInfo& device) {
    const bool mapped = options.tuning.pool_place == PoolPlace::host;
    ResidencySettings settings;
    settings.form = plan.form;
    settings.place = options.tuning.pool_place;
    settings.pool_bytes = mapped ? whole_pool_bytes(scene, plan.form, device) : pool_bytes;
    settings.slab_bytes = instruments.slab_bytes;
    settings.journal = instruments.keep_journal;
    settings.host_limit = mapped ? plan.host_limit - settings.pool_bytes : plan.host_limit;
    settings.loader_threads = instruments.loader_threads;
    settings.read_ahead_threads = instruments.read_ahead_threads;
    settings.policy = policy_settings(scene, plan.form, options, instruments, settings.pool_bytes, device);
    return settings;
}

}  // namespace

namespace {

// Rows of the film that are on the device at a time are whole tiles.
void choose_tile(rp_render_params& params, uint32_t tile) {
    if (params.film_rows < params.height && params.film_rows > tile) params.film_rows -= params.film_rows % tile;
    if (params.film_rows == params.height || params.film_rows % tile == 0) params.order.tile_size = tile;
}

}  // namespace

Result<RenderPlan> plan_render(const BakedScene& scene, const RenderOptions& options, const RenderInstruments& instruments,
                               const rp_render_params& params, const DeviceInfo& device, uint64_t memory_limit, const Sharers& sharers) {
    RAYPAGER_TRY(check_traversal(options.tuning.traversal, device, scene.instance_levels()));
    if (scene.instances > 0 && instruments.record_paths > 0) return Status::usage("rays of a scene with instances cannot be recorded");
    RenderPlan plan;
    plan.params = params;
    plan.visits = visit_log_settings(scene, options, instruments, params, device);
    // Visits can be recorded only of rays that are traced one by one.
    plan.form = block_form(instruments.record_paths > 0 ? Traversal::ray : options.tuning.traversal, device, scene.instance_levels());
    const MemoryNeeds needs = memory_needs(scene, plan.form, options, instruments, params, plan.visits, device, memory_limit, sharers);
    const auto memory = plan_memory(needs);
    const auto host_limit_beside = [&](uint64_t device_bytes, uint64_t film_bytes) {
        return sharers.host_limit ? sharers.host_limit : host_limit(options, device, sharers.devices * device_bytes, sharers.processes, film_bytes);
    };
    if (!memory) {  // and who gives what it asks for is not to learn then that something else is missing
        const Status host =
            check_host_pool(scene, plan.form, options, host_limit_beside(needs.fixed + min_slots * needs.per_slot, needs.film), device);
        return host ? memory.status() : Status::failed(memory.status().message() + "; and " + host.message());
    }
    plan.params.slot_count = static_cast<uint32_t>(memory->slots);
    const uint64_t pixels = uint64_t{params.width} * params.height;
    if (chooses_region(options)) plan.params.order.region = chosen_region(params.order, *memory, needs, pixels);
    const uint64_t film_row = needs.film / params.height;
    plan.params.film_rows = static_cast<uint32_t>(memory->film_bytes / film_row);
    if (plan.params.order.region > 0 && chooses_tile(options) && !holds_all(*memory, needs)) choose_tile(plan.params, device.profile.region_tile);
    plan.device_bytes = needs.fixed + plan.params.film_rows * film_row + memory->slots * needs.per_slot + memory->pool_bytes;
    plan.host_limit = host_limit_beside(plan.device_bytes, plan.params.film_rows < params.height ? host_film_bytes(plan.params) : 0);
    RAYPAGER_TRY(check_host_pool(scene, plan.form, options, plan.host_limit, device));
    plan.residency = plan_residency(scene, options, instruments, plan, memory->pool_bytes, device);
    const bool resident = holds_all(*memory, needs);
    plan.notes = resident ? BlockNotes() : block_notes(options.tuning.policy);
    plan.filled_together = filled_together(plan.params.order, *memory, needs);
    plan.fills_by_waits = plan.filled_together > 1 && !resident;
    // Rounds that are waited for, or recorded, run one by one.
    const uint32_t most =
        instruments.rounds_under_way ? instruments.rounds_under_way : std::min(device.profile.rounds_under_way, Wavefront::max_rounds);
    plan.rounds_under_way = options.tuning.wait_for_loads || instruments.record_paths > 0 ? 1 : most;
    return plan;
}

}  // namespace raypager
