#include "wavefront/stream_backend.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "wavefront/page_changes.hpp"
#include "wavefront/sleep_groups.hpp"

namespace raypager {

Result<std::unique_ptr<Backend>> StreamBackend::create(Device& device, const rp_render_params& params, const GeometryBuffers& geometry,
                                                       const WavefrontBuffers& buffers, const BackendSettings& settings) {
    std::unique_ptr<StreamBackend> backend(new StreamBackend(device, params, geometry, buffers));
    RAYPAGER_TRY(backend->allocate());
    RAYPAGER_TRY(backend->build(settings));
    return std::unique_ptr<Backend>(std::move(backend));
}

uint32_t StreamBackend::wake_items() const { return std::min(device_.info().compute_units * device_.profile().wake_items, extra_queue_words); }

Status StreamBackend::allocate() {
    const uint64_t slots = params_.slot_count;
    auto buffer = device_.allocate(RP_AWAKE_WORDS(slots) * sizeof(uint64_t), "slots that are awake");
    if (!buffer) return buffer.status();
    awake_ = std::move(*buffer);
    return wake_all_slots();
}

Status StreamBackend::wake_all_slots() {
    const uint64_t slots = params_.slot_count;
    std::vector<uint64_t> awake(RP_AWAKE_WORDS(slots), ~uint64_t{0});
    if (slots % RP_AWAKE_SLOTS != 0) awake.back() >>= RP_AWAKE_SLOTS - slots % RP_AWAKE_SLOTS;
    return device_.kernels().write_now(awake_, 0, std::as_bytes(std::span(awake)));
}

Status StreamBackend::build(const BackendSettings& settings) {
    const std::string all = geometry_.definitions() + settings.tracing + settings.shading + settings.cameras + " -DRP_SHADE_LANES=16";
    std::vector<Wanted> kernels;
    const auto add = [&](Kernel& kernel, const char* name) { kernels.push_back({kernel, {"stream/all_stages", name, all}}); };
    add(begin_, "rp_begin_round");
    add(wake_, "rp_wake_stream");
    add(generate_, "rp_generate_stream");
    add(trace_, "rp_trace_stream");
    add(shade_, "rp_shade");
    add(report_, "rp_report");
    RAYPAGER_TRY(get_kernels(kernels));
    notes_ = settings.notes;
    textures_ = settings.textures;
    const WavefrontBuffers& b = buffers_;
    if (textures_) return {};
    return shade_.set(b.params, b.materials, b.lights, b.light_steps, b.ranges, b.queue, b.slots.status(), b.slots.planes(), b.counters, b.film);
}

Status StreamBackend::launch(const Round& round, StageEvents& events) {
    const uint32_t slots = params_.slot_count, blocks = geometry_.block_count(), cores = device_.info().compute_units;
    const uint32_t noted_round = notes_ ? round.number : 0;
    const WavefrontBuffers& b = buffers_;
    Queue& queue = device_.kernels();
    const std::vector<RoundBegin> begins = round_begins(round.page_changes, round.newly_published, blocks);
    for (const RoundBegin& begin : begins) {
        RAYPAGER_TRY(begin_.set(b.slots.status(), geometry_.pages(), blocks, slots, awake_, b.counters, geometry_.demand(), begin.named, begin.names,
                                begin.changes));
        RAYPAGER_TRY(queue.launch(begin_, begin.named > 0 || &begin == &begins.back() ? wake_items() : 1, 1, &events.begin));
    }
    RAYPAGER_TRY(wake_.set(b.slots.status(), slots, awake_, b.queue, b.free_list, b.counters, block_scale(blocks, RP_BUNDLES)));
    RAYPAGER_TRY(queue.launch(wake_, wake_items(), 1, &events.wake));
    const uint32_t group = device_.group_size();
    RAYPAGER_TRY(set_generate(generate_, round));
    RAYPAGER_TRY(queue.launch(generate_, uint64_t{cores} * device_.profile().generate_groups * group, group, &events.generate));
    RAYPAGER_TRY(geometry_.set(trace_, noted_round, slots, b.queue, b.slots.status(), b.slots.planes(), b.counters, b.params, b.ranges, b.film));
    RAYPAGER_TRY(geometry_.launch(device_, queue, trace_, slots, &events.extend));
    if (textures_)
        RAYPAGER_TRY(geometry_.set(shade_, noted_round, b.textures, b.free_list, b.params, b.materials, b.lights, b.light_steps, b.ranges, b.queue,
                                   b.slots.status(), b.slots.planes(), b.counters, b.film));
    RAYPAGER_TRY(queue.launch(shade_, uint64_t{cores} * device_.profile().shade_items, 1, &events.shade));
    constexpr uint32_t marks = 64;  // in a row
    return launch_report(round, std::clamp<uint64_t>(RP_MARK_WORDS(uint64_t{blocks}) / marks, 1, uint64_t{cores} * 4), 1, marks);
}

// Requests per block and RP_COUNT_IN_LISTS count the same waiting rays. If they did not agree, a block would be loaded for nobody, for ever.
Status StreamBackend::check_round(const RoundCounters& counters, std::span<const rp_block_demand> demand) {
    requests_.resize(geometry_.block_count());
    for (const rp_block_demand& told : demand) {
        all_requests_ += uint64_t{told.requests} - requests_[told.block];
        requests_[told.block] = told.requests;
    }
    if (all_requests_ == counters.words[RP_COUNT_IN_LISTS]) return {};
    return Status::failed(
        fmt::format("{} rays wait, but blocks are requested by {}; this is a bug", counters.words[RP_COUNT_IN_LISTS], all_requests_));
}

}  // namespace raypager
