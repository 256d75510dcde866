#include "render/setup.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <span>

#include "base/hash.hpp"
#include "base/memory.hpp"
#include "base/words.hpp"
#include "device/kernel_tokens.hpp"
#include "raypager/abi/film.h"
#include "residency/residency.hpp"
#include "wavefront/sample_order.hpp"

namespace raypager {
namespace {

// On CPUs it is streams that gain by more rays to choose from.
uint64_t roomy_slots(BlockForm form, const DeviceProfile& profile) {
    return profile.caches_slots && form != BlockForm::wide ? 0 : profile.roomy_slots;
}

// Renders with a checkpoint are there to be stopped and looked at.
bool is_seen_growing(const RenderOptions& options) {
    return options.time_seconds > 0 || options.snapshot_seconds > 0 || !options.checkpoint.file.empty();
}

// A film pixel holds so many samples of any radiance (abi/film.h).
constexpr uint32_t max_spp = 65535;

void set3(float (&target)[3], const Float3& value) {
    target[0] = value.x;
    target[1] = value.y;
    target[2] = value.z;
}
void set3(float (&target)[4], const Float3& value) {
    target[0] = value.x;
    target[1] = value.y;
    target[2] = value.z;
    target[3] = 0;
}

uint32_t background_identity(const rp_render_params& params) {
    if (params.background_kind == RP_BACKGROUND_LIGHTS) return 0;
    return static_cast<uint32_t>(hash64(std::as_bytes(std::span(params.background)), params.background_kind)) | 1u;
}

}  // namespace

Result<rp_render_params> make_params(const BakedScene& scene, const RenderOptions& options) {
    rp_render_params params = {};
    const Camera& camera = options.camera ? *options.camera : scene.camera;
    set3(params.camera.eye, camera.eye);
    set3(params.camera.right, camera.right);
    set3(params.camera.up, camera.up);
    set3(params.camera.forward, camera.forward);
    params.width = options.width ? options.width : scene.width;
    params.height = options.height ? options.height : scene.height;
    // With a time limit alone, the time decides.
    params.spp = options.spp ? options.spp : options.time_seconds > 0 ? max_spp : scene.spp;
    params.max_depth = options.max_depth ? *options.max_depth : scene.max_depth;
    params.seed = options.seed;
    params.light_count = static_cast<uint32_t>(scene.lights.size());
    params.range_count = static_cast<uint32_t>(scene.ranges.size());
    params.infinite_light = RP_NONE;
    for (uint32_t i = 0; i < scene.lights.size(); i++)
        if (scene.lights[i].kind == RP_LIGHT_INFINITE) params.infinite_light = i;
    if (options.background) {
        params.background_kind = options.background->transparent ? RP_BACKGROUND_TRANSPARENT : RP_BACKGROUND_COLOR;
        if (!options.background->transparent) set3(params.background, options.background->color);
    }
    params.max_luminance = scene.film.max_luminance;
    params.max_xyz = scene.film.max_xyz;
    params.roulette_connection = options.connection == Connection::roulette;
    const uint64_t pixels = uint64_t{params.width} * params.height;
    constexpr uint32_t longest_side = 1 << 20;  // kernels multiply it by the size of a tile
    if (params.width > longest_side || params.height > longest_side)
        return Status::usage(fmt::format("--size: at most {} pixels a side", longest_side));
    if (pixels == 0 || pixels > uint64_t{1} << 31)
        return Status::usage(fmt::format("--size {}x{}: between 1 and 2^31 pixels are possible", params.width, params.height));
    if (params.spp == 0 || params.spp > max_spp) return Status::usage(fmt::format("--spp {}: from 1 to {}", params.spp, max_spp));
    if (options.tile_size < 1 || options.tile_size > largest_tile)
        return Status::usage(fmt::format("--tile {}: from 1 to {}", options.tile_size, largest_tile));
    if (options.together > most_together) return Status::usage(fmt::format("--together {}: from 1 to {}", options.together, most_together));
    const uint32_t together = options.together ? options.together : is_seen_growing(options) ? 1 : default_together(pixels);
    params.order = make_order(options.tile_size, together, params.spp, pixels, options.region.value_or(0));
    if (options.record_paths && !options.spp && options.time_seconds > 0)
        return Status::usage("--record-trace needs --spp as well as --time: the share of paths to record follows from how many there can be");
    if (options.record_paths && options.checkpoint.resume)
        return Status::usage("--record-trace: a render that goes on from a checkpoint cannot be recorded whole; leave --resume out");
    if (params.max_depth > 60000) return Status::usage("--max-depth: at most 60000");
    params.sample_limit = pixels * params.spp;
    return params;
}

bool chooses_region(const RenderOptions& options) { return !options.region && !is_seen_growing(options); }

RenderIdentity identity_of(const BakedScene& scene, const rp_render_params& params) {
    RenderIdentity identity;
    identity.scene = scene.identity();
    identity.kernels = kernels_identity(kernel_sources(), render_stages);
    identity.width = params.width;
    identity.height = params.height;
    identity.max_depth = params.max_depth;
    identity.seed = params.seed;
    identity.roulette_connection = params.roulette_connection;
    identity.background = background_identity(params);
    identity.camera = params.camera;
    return identity;
}

Status check_picture_size(const rp_render_params& params, const DeviceInfo& device) {
    const uint64_t pixels = uint64_t{params.width} * params.height;
    const uint64_t film = pixels * RP_FILM_WORDS * sizeof(uint32_t), most = device.max_allocation_bytes;
    if (film > most)
        return Status::failed(fmt::format(
            "--size {}x{}: the film needs {} at once, but {} allocates at most {}; at most {} pixels are possible there", params.width, params.height,
            format_exact_bytes(film), device.name, format_bytes(most), format_count(most / RP_FILM_WORDS / sizeof(uint32_t))));
    const uint64_t channels = params.background_kind == RP_BACKGROUND_TRANSPARENT ? 4 : 3;
    const uint64_t picture = pixels * channels * sizeof(float), free = available_memory();
    if (picture > free)
        return Status::failed(fmt::format("--size {}x{}: the picture needs {} of main memory, of which {} are free; render a smaller one",
                                          params.width, params.height, format_bytes(picture), format_bytes(free)));
    return {};
}

VisitLogSettings visit_log_settings(const BakedScene& scene, const RenderOptions& options, const rp_render_params& params, const DeviceInfo& device) {
    VisitLogSettings visits;
    if (options.record_paths == 0) return visits;
    const double share = std::min(1.0, static_cast<double>(options.record_paths) / static_cast<double>(params.sample_limit));
    const double slots = static_cast<double>(options.paths ? options.paths : device.profile.most_slots);
    visits.threshold = static_cast<uint32_t>(share * 4294967295.0);
    // What one shadow ray passes is logged together (kernels/single_ray/visits.cl).
    const double least = 256 + static_cast<double>(scene.blocks.size());
    visits.capacity = static_cast<uint32_t>(std::clamp(share * slots * 4, least, std::max(least, 4194304.0)));
    if (options.visit_events) visits.capacity = options.visit_events;
    return visits;
}

BlockForm block_form(const RenderOptions& options, const DeviceInfo& device) {
    return block_form(options.record_paths > 0 ? Traversal::ray : options.traversal, device);
}

MemoryNeeds memory_needs(const BakedScene& scene, BlockForm form, const RenderOptions& options, const rp_render_params& params,
                         const VisitLogSettings& visits, const DeviceInfo& device, uint64_t device_limit) {
    const WavefrontBytes bytes = wavefront_bytes(scene, form, params.width, params.height);
    MemoryNeeds needs;
    needs.limit = device_limit;
    needs.fixed = bytes.scene + bytes.film + std::max<uint64_t>(scene.blocks.size(), 1) * sizeof(rp_page) + RP_BLOCK_ALIGNMENT + visits.bytes();
    needs.per_slot = bytes.per_slot;
    if (options.pool_place == PoolPlace::device) {
        needs.largest_block = scene.largest_block(form);
        needs.geometry = whole_pool_bytes(scene, form, device);
        needs.geometry_limit = options.geometry_limit;
        if (const uint64_t most = largest_pool(device.max_allocation_bytes); needs.geometry > most)
            needs.geometry_limit = options.geometry_limit ? std::min(options.geometry_limit, most) : most;
        needs.geometry_limit_percent = options.geometry_limit_percent;
    }
    needs.requested_slots = options.paths;
    const DeviceProfile& profile = device.profile;
    needs.default_slots = profile.default_slots;
    needs.roomy_slots = roomy_slots(form, profile);
    needs.most_chosen_slots = profile.most_slots;
    needs.most_slot_bytes = profile.scenes_for_slots * needs.geometry;
    needs.near_slots = profile.caches_slots ? needs.roomy_slots : 0;
    needs.slots_for_loads = profile.loads_for_slots;
    // Of a render that ends by the clock, all that is under way then must still come to its end: a few samples a pixel.
    constexpr uint64_t few_spp = 16;
    needs.total_paths = options.time_seconds > 0 ? std::min(params.sample_limit, few_spp * params.width * params.height) : params.sample_limit;
    needs.most_region_slots = chooses_region(options) ? most_slots_with_regions(params.order, uint64_t{params.width} * params.height) : 0;
    needs.most_slots = device.max_allocation_bytes / bytes.largest_part_per_slot;
    return needs;
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

BlockNotes block_notes(PolicyKind policy) {
    return {.bounces = policy == PolicyKind::most_wanted, .use = counts_entries(policy) ? BlockNotes::Use::entries : BlockNotes::Use::last_round};
}

PolicySettings policy_settings(const BakedScene& scene, BlockForm form, const RenderOptions& options, uint64_t pool_bytes, const DeviceInfo& device) {
    const uint64_t average = scene.blocks.empty() ? 0 : scene.geometry_bytes(form) / scene.blocks.size();
    PolicySettings policy = default_settings(options.policy, pool_bytes, average, device.profile);
    if (options.evict_ahead) policy.evict_ahead = *options.evict_ahead;
    if (options.loads_in_flight) {
        policy.loads_in_flight = policy.loads_while_idle = options.loads_in_flight;
        policy.evict_ahead = std::min(policy.evict_ahead, options.loads_in_flight);
    }
    if (options.hold_above_ready) policy.hold_above_ready = *options.hold_above_ready;
    return policy;
}

uint64_t whole_pool_bytes(const BakedScene& scene, BlockForm form, const DeviceInfo& device) {
    return pool_for_all(scene.geometry_bytes(form), device.max_allocation_bytes, scene.largest_block(form));
}

uint64_t host_limit(const RenderOptions& options, const DeviceInfo& device, uint64_t planned_bytes) {
    if (options.host_limit) return options.host_limit;
    // What such a device takes comes out of the same memory.
    const uint64_t taken = device.profile.shares_host_memory ? planned_bytes : 0;
    const auto left = [taken](uint64_t memory) { return memory - std::min(memory, taken); };
    return default_limit(left(total_memory()) / 2, left(available_memory())).bytes;
}

}  // namespace raypager
