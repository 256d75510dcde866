#include "wavefront/single_ray_backend.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "base/check.hpp"
#include "raypager/abi/visits.h"
#include "wavefront/page_changes.hpp"
#include "wavefront/sleep_groups.hpp"

namespace raypager {
namespace {

constexpr uint64_t sleep_group_count(uint64_t slots) { return (slots + RP_SLEEP_GROUP - 1) / RP_SLEEP_GROUP; }

}  // namespace

Result<std::unique_ptr<Backend>> SingleRayBackend::create(Device& device, const rp_render_params& params, const GeometryBuffers& geometry,
                                                          const WavefrontBuffers& buffers, const BackendSettings& settings,
                                                          const VisitLogSettings& visits) {
    std::unique_ptr<SingleRayBackend> backend(new SingleRayBackend(device, params, geometry, buffers));
    backend->visit_settings_ = visits;
    RAYPAGER_TRY(backend->allocate());
    RAYPAGER_TRY(backend->build(settings));
    return std::unique_ptr<Backend>(std::move(backend));
}

Status SingleRayBackend::allocate() {
    auto sleep_groups = device_.allocate(sleep_group_count(params_.slot_count) * sizeof(uint64_t), "sleeping slots");
    if (!sleep_groups) return sleep_groups.status();
    sleep_groups_ = std::move(*sleep_groups);
    if (visit_settings_.capacity == 0) return {};
    auto visits = device_.allocate(visit_settings_.bytes(), "the log of visits");
    if (!visits) return visits.status();
    visits_ = std::move(*visits);
    const uint32_t header[RP_VISIT_HEADER] = {0, visit_settings_.capacity, visit_settings_.threshold, 0};
    return device_.kernels().write_now(visits_, 0, std::as_bytes(std::span(header)));
}

Status SingleRayBackend::build(const BackendSettings& settings) {
    const DeviceProfile& profile = device_.profile();
    const std::string states = short_states + settings.single_rays;
    const std::string common =
        device_.register_limit(profile.shading_registers) + geometry_.definitions() + states +
        fmt::format(" -DRP_WAKE_GROUP={} -DRP_WAKE_SLEEP_GROUPS={} -DRP_SHADE_LANES=1", device_.group_size(), profile.wake_sleep_groups);
    // Persistent threads do not record.
    persistent_ = visit_settings_.capacity == 0 && device_.has_persistent_threads();
    const std::string common_tracing = settings.tracing + (visit_settings_.capacity ? " -DRP_RECORD" : "") + states;
    std::vector<Wanted> kernels;
    const auto trace = [&](Kernel& kernel, const char* stage, uint32_t registers, const std::string& more) {
        kernels.push_back({kernel, geometry_.kernel_name(device_, stage, registers, common_tracing + more)});
    };
    kernels.push_back(
        {shade_,
         {"shading/shade", "rp_shade", device_.quick_arithmetic() + common + settings.shading + (settings.textures ? settings.tracing : "")}});
    trace(connect_, "connect", profile.any_hit_registers, "");
    if (persistent_) trace(extend_bounces_, "extend", profile.closest_hit_registers, device_.bounce_definitions());
    trace(extend_, "extend", profile.closest_hit_registers, persistent_ ? device_.camera_definitions() : "");
    kernels.push_back({generate_, {"single_ray/generate", "rp_generate", common + settings.cameras}});
    kernels.push_back({advance_, {"single_ray/generate", "rp_advance", common + settings.cameras}});
    kernels.push_back({wake_, {"single_ray/wake", "rp_wake", common}});
    kernels.push_back({publish_, {"single_ray/publish", "rp_publish", settings.tracing}});
    kernels.push_back({report_, {"single_ray/publish", "rp_report", settings.tracing}});
    RAYPAGER_TRY(get_kernels(kernels));
    textures_ = settings.textures;
    return textures_ ? Status() : set_shading_arguments();
}

template <class... First>
Status SingleRayBackend::set_shading_arguments(const First&... first) {
    const WavefrontBuffers& b = buffers_;
    return geometry_.set(shade_, first..., b.params, b.materials, b.lights, b.light_steps, b.ranges, b.queue, b.slots.status(), b.slots.planes(),
                         b.counters, b.film);
}

void SingleRayBackend::fill_together(uint32_t slots) {
    RAYPAGER_CHECK(slots == 1 || slots == 2 || slots == 4 || slots == 8);
    filled_together_ = slots;
}

Status SingleRayBackend::change_pages(std::span<const rp_page> changes) {
    while (!changes.empty()) {
        RAYPAGER_TRY(publish_.set(geometry_.pages(), geometry_.block_count(), geometry_.demand(), take_changes(changes)));
        RAYPAGER_TRY(device_.kernels().launch(publish_, 1, 1));
    }
    return {};
}

Status SingleRayBackend::set_tracing_arguments(Kernel& extend, uint32_t round) {
    const WavefrontBuffers& b = buffers_;
    const uint32_t slots = params_.slot_count;
    if (visit_settings_.capacity == 0) {
        RAYPAGER_TRY(geometry_.set(extend, round, slots, b.queue, b.slots.status(), b.slots.planes(), b.counters));
        return geometry_.set(connect_, round, slots, b.queue, b.slots.status(), b.slots.planes(), b.counters, b.params, b.ranges, b.film);
    }
    RAYPAGER_TRY(device_.kernels().fill_zero(visits_, RP_VISIT_RESERVED * sizeof(uint32_t), sizeof(uint32_t)));
    RAYPAGER_TRY(geometry_.set(extend, round, slots, b.queue, b.slots.status(), b.slots.planes(), b.counters, visits_));
    return geometry_.set(connect_, round, slots, b.queue, b.slots.status(), b.slots.planes(), b.counters, b.params, b.ranges, b.film, visits_);
}

// For which of them it has to be asked whether they are resident, so that nobody waits for them: all, where the table was written as a whole. While
// visits are recorded, a ray that finds no room in the log waits although its block is there.
uint32_t SingleRayBackend::blocks_to_ask(const Round& round) const {
    const bool all = visit_settings_.capacity > 0 || (round.page_changes.empty() && !round.newly_published.empty());
    return all ? geometry_.block_count() : 0;
}

Status SingleRayBackend::set_arguments(Kernel& extend, const Round& round) {
    const WavefrontBuffers& b = buffers_;
    RAYPAGER_TRY(set_tracing_arguments(extend, round.number));
    if (textures_) RAYPAGER_TRY(set_shading_arguments(round.number, b.textures, b.free_list));
    RAYPAGER_TRY(set_generate(generate_, round));
    const uint32_t blocks = geometry_.block_count();
    RAYPAGER_TRY(
        advance_.set(b.params, b.counters, geometry_.pages(), blocks_to_ask(round), blocks, geometry_.demand(), round.numbers, round.listed_again));
    const uint32_t bit_scale = sleep_bit_scale(blocks);
    // While visits are recorded, a ray that finds no room in the log waits although its block is there.
    const cl_ulong came = visit_settings_.capacity == 0 ? sleep_bits(round.newly_published, bit_scale) : all_sleep_bits;
    return wake_.set(b.slots.status(), geometry_.pages(), params_.slot_count, b.queue, b.free_list, b.counters, sleep_groups_, bit_scale, came,
                     filled_together_);
}

Status SingleRayBackend::launch(const Round& round, StageEvents& events) {
    const uint32_t slots = params_.slot_count, group = device_.group_size();
    const uint32_t items = std::min(slots, device_.info().compute_units * device_.profile().items);
    Queue& queue = device_.kernels();
    RAYPAGER_TRY(change_pages(round.page_changes));
    RAYPAGER_TRY(queue.fill_zero(buffers_.counters, 0, RP_COUNTERS_PER_ROUND * sizeof(uint32_t)));
    // Camera rays are all there is in the first round.
    Kernel& extend = persistent_ && round.number > 1 ? extend_bounces_ : extend_;
    RAYPAGER_TRY(set_arguments(extend, round));
    RAYPAGER_TRY(queue.launch(wake_, (sleep_group_count(slots) + device_.profile().wake_sleep_groups - 1) / device_.profile().wake_sleep_groups,
                              group, &events.wake));
    // Shadow rays beside extension rays: each stage has long waits for its last rays, and with few rays nothing else. What one writes the other does
    // not read: their slots are different ones.
    if (connects_concurrently()) {
        RAYPAGER_TRY(queue.flush());
        RAYPAGER_TRY(device_.concurrent().wait_for(events.wake));
        RAYPAGER_TRY(geometry_.launch(device_, device_.concurrent(), connect_, slots, &events.connect));
        RAYPAGER_TRY(device_.concurrent().flush());
    }
    RAYPAGER_TRY(queue.launch(generate_, items, group, &events.generate));
    RAYPAGER_TRY(queue.launch(advance_, std::max<uint32_t>(blocks_to_ask(round), 1), group));
    if (persistent_)
        RAYPAGER_TRY(queue.launch(extend, std::min<uint64_t>(items, device_.persistent_items()), group, &events.extend));
    else
        RAYPAGER_TRY(geometry_.launch(device_, queue, extend, slots, &events.extend));
    RAYPAGER_TRY(queue.launch(shade_, items, group, &events.shade));
    if (connects_concurrently())
        RAYPAGER_TRY(queue.wait_for(events.connect));
    else
        RAYPAGER_TRY(geometry_.launch(device_, queue, connect_, slots, &events.connect));
    const uint64_t marks = RP_MARK_WORDS(uint64_t{geometry_.block_count()});
    return launch_report(round, std::clamp<uint64_t>(marks, RP_COUNTER_WORDS, std::max<uint32_t>(items, RP_COUNTER_WORDS)), group, 1);
}

Status SingleRayBackend::read_visits(std::vector<uint32_t>& words) {
    RAYPAGER_CHECK(visit_settings_.capacity > 0);
    uint32_t reserved = 0;
    RAYPAGER_TRY(device_.kernels().read_now(visits_, RP_VISIT_RESERVED * sizeof(uint32_t), std::as_writable_bytes(std::span(&reserved, 1))));
    words.resize(size_t{RP_VISIT_WORDS} * std::min(reserved, visit_settings_.capacity));
    if (words.empty()) return {};
    return device_.kernels().read_now(visits_, RP_VISIT_HEADER * sizeof(uint32_t), std::as_writable_bytes(std::span(words)));
}

}  // namespace raypager
