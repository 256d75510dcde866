#include "wavefront/wavefront.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "base/check.hpp"
#include "blocks/light_choice.hpp"
#include "raypager/abi/film.h"
#include "raypager/abi/visits.h"
#include "wavefront/naps.hpp"
#include "wavefront/page_changes.hpp"

namespace raypager {
namespace {

constexpr uint32_t most_wake_items = 1024;  // each has a word of the queue for what stands for nothing

// Words of a slot in the buffer of status words.
uint64_t status_words(bool vertex_colors) { return vertex_colors ? 3 : 2; }

// Planes; status words, queue, free list; shares of `again_` and of `naps_` or `awake_`.
uint64_t path_bytes(bool vertex_colors) { return RP_PATH_PLANES * 16 + (status_words(vertex_colors) + 2) * sizeof(uint32_t) + 1 + 1; }

// The list of samples to be traced again has one place for eight slots: a resumed render has all its paths under way after eight rounds.
constexpr uint64_t again_bytes(uint64_t slots) { return 16 + slots / 16 * 16; }

constexpr uint64_t nap_count(uint64_t slots) { return (slots + RP_NAP - 1) / RP_NAP; }

template <class T>
std::span<const std::byte> bytes_of_one(const T& value) {
    return std::as_bytes(std::span(&value, 1));
}

}  // namespace

WavefrontBytes wavefront_bytes(const BakedScene& scene, BlockForm form, uint32_t width, uint32_t height) {
    WavefrontBytes bytes;
    bytes.scene = at_least_16(sizeof(rp_render_params)) + at_least_16(scene.materials.size() * sizeof(rp_material)) +
                  at_least_16(scene.lights.size() * sizeof(rp_light)) + at_least_16(light_choice_bytes(scene.lights)) +
                  at_least_16(scene.ranges.size() * sizeof(rp_primitive_range)) + GeometryBuffers::bytes(scene, form) +
                  RP_COUNTER_WORDS * sizeof(uint32_t) + again_bytes(0) + sizeof(uint64_t) +
                  status_words(scene.has_vertex_colors()) * RP_NAP * sizeof(uint32_t) +
                  (form == BlockForm::wide ? most_wake_items * sizeof(uint32_t) : 0);
    bytes.film = uint64_t{width} * height * RP_FILM_WORDS * sizeof(uint32_t);
    bytes.per_slot = path_bytes(scene.has_vertex_colors());
    bytes.largest_part_per_slot = RP_PATH_PLANES * 16;
    return bytes;
}

std::string BlockNotes::definitions(BlockForm form, uint32_t slots) const {
    std::string result = bounces ? " -DRP_COUNT_BOUNCES" : "";
    if (use == Use::last_round) result += " -DRP_NOTE_ROUNDS";
    // Of single rays a sample is enough to tell blocks apart, and costs nothing. Each number has kernels of its own, so there are not many.
    const int counted = form == BlockForm::wide || slots < 1u << 18 ? 1 : slots < 1u << 22 ? 8 : 256;
    if (use == Use::entries) result += fmt::format(" -DRP_COUNT_ENTRIES={}u", counted - 1);
    return result;
}

Result<std::unique_ptr<Wavefront>> Wavefront::create(Device& device, const BakedScene& scene, BlockForm form, const rp_render_params& params,
                                                     const std::vector<Buffer>& slabs, const Buffer& page_table, uint32_t filled_together,
                                                     const BlockNotes& notes, const VisitLogSettings& visits) {
    RAYPAGER_CHECK(form == BlockForm::stored || visits.capacity == 0);
    RAYPAGER_CHECK(params.slot_count > 0 && uint64_t{params.width} * params.height > 0);
    auto geometry = GeometryBuffers::create(device, scene, form, slabs, page_table);
    if (!geometry) return geometry.status();
    std::unique_ptr<Wavefront> wavefront(new Wavefront(device, params, std::move(*geometry)));
    wavefront->fill_together(filled_together);
    if (!scene.blocks.empty()) wavefront->notes_ = notes;
    RAYPAGER_TRY(wavefront->upload_scene(scene));
    if (has_light_tree(scene.lights)) wavefront->shading_ = " -DRP_LIGHT_TREE";
    wavefront->visit_settings_ = visits;
    RAYPAGER_TRY(wavefront->allocate_state(scene.has_vertex_colors()));
    if (visits.capacity) RAYPAGER_TRY(wavefront->allocate_visit_log());
    RAYPAGER_TRY(wavefront->build_kernels());
    return wavefront;
}

uint32_t Wavefront::wake_items() const { return std::min(device_.info().compute_units * device_.profile().wake_items, most_wake_items); }

Status Wavefront::upload_scene(const BakedScene& scene) {
    std::vector<rp_light> lights = scene.lights;
    const std::vector<uint32_t> choice = light_choice(lights);
    struct Part {
        Buffer& buffer;
        std::span<const std::byte> contents;
        const char* what;
    };
    const Part parts[] = {{params_buffer_, bytes_of_one(params_), "render parameters"},
                          {materials_, bytes_of(scene.materials), "materials"},
                          {lights_, bytes_of(lights), "lights"},
                          {light_steps_, bytes_of(choice), "light probabilities"},
                          {ranges_, bytes_of(scene.ranges), "primitive ranges"}};
    for (const Part& part : parts) {
        auto buffer = device_.upload(part.contents, part.what);
        if (!buffer) return buffer.status();
        part.buffer = std::move(*buffer);
    }
    return {};
}

Status Wavefront::allocate_state(bool vertex_colors) {
    const uint64_t slots = params_.slot_count, queue_words = slots + (as_on_cpus() ? most_wake_items : 0);
    struct Part {
        Buffer& buffer;
        uint64_t bytes;
        const char* what;
    };
    const Part parts[] = {{film_, uint64_t{params_.width} * params_.height * RP_FILM_WORDS * sizeof(uint32_t), "the film"},
                          {status_, status_words(vertex_colors) * RP_STATUS_WORDS(slots) * sizeof(uint32_t), "path states"},
                          {paths_, slots * RP_PATH_PLANES * 16, "path slots"},
                          {queue_, queue_words * sizeof(uint32_t), "the ray queue"},
                          {free_list_, slots * sizeof(uint32_t), "the free list"},
                          {again_, again_bytes(slots), "samples to trace again"},
                          {naps_, as_on_cpus() ? 0 : nap_count(slots) * sizeof(uint64_t), "sleeping slots"},
                          {awake_, as_on_cpus() ? RP_AWAKE_WORDS(slots) * sizeof(uint64_t) : 0, "slots that are awake"},
                          {counters_, RP_COUNTER_WORDS * sizeof(uint32_t), "counters"}};
    for (const Part& part : parts) {
        if (part.bytes == 0) continue;
        auto buffer = device_.allocate(part.bytes, part.what);
        if (!buffer) return buffer.status();
        part.buffer = std::move(*buffer);
    }
    for (const Buffer* buffer : {&film_, &status_, &counters_}) RAYPAGER_TRY(device_.kernels().fill_zero(*buffer, 0, buffer->bytes()));
    for (Flight& flight : flights_) {
        auto results = device_.allocate_pinned(counters_.bytes() + uint64_t{geometry_.block_count()} * RP_DEMAND_ARRAYS * sizeof(uint32_t));
        if (!results) return results.status();
        flight.results = std::move(*results);
    }
    if (as_on_cpus()) {
        std::vector<uint64_t> awake(RP_AWAKE_WORDS(slots), ~uint64_t{0});
        if (slots % RP_AWAKE_SLOTS != 0) awake.back() >>= RP_AWAKE_SLOTS - slots % RP_AWAKE_SLOTS;
        RAYPAGER_TRY(device_.kernels().write_now(awake_, 0, bytes_of(awake)));
    }
    const uint64_t first = params_.first_sample;
    const uint32_t words[2] = {static_cast<uint32_t>(first), static_cast<uint32_t>(first >> 32)};
    return device_.kernels().write_now(counters_, RP_COUNT_NEXT_SAMPLE * sizeof(uint32_t), std::as_bytes(std::span(words)));
}

uint64_t VisitLogSettings::bytes() const { return capacity ? (RP_VISIT_HEADER + uint64_t{RP_VISIT_WORDS} * capacity) * sizeof(uint32_t) : 0; }

Status Wavefront::allocate_visit_log() {
    auto buffer = device_.allocate(visit_settings_.bytes(), "the log of visits");
    if (!buffer) return buffer.status();
    visits_ = std::move(*buffer);
    const uint32_t header[RP_VISIT_HEADER] = {0, visit_settings_.capacity, visit_settings_.threshold, 0};
    return device_.kernels().write_now(visits_, 0, std::as_bytes(std::span(header)));
}

Status Wavefront::build_kernels() {
    const std::string notes = notes_.definitions(geometry_.form(), params_.slot_count);
    return as_on_cpus() ? build_streams(notes) : build_stages(notes);
}

Status Wavefront::get_kernels(std::initializer_list<Wanted> kernels, const std::string& definitions) {
    for (const Wanted& wanted : kernels) {
        auto kernel = device_.kernel(wanted.stage, wanted.name, definitions);
        if (!kernel) return kernel.status();
        wanted.kernel = std::move(*kernel);
    }
    return {};
}

Status Wavefront::build_streams(const std::string& notes) {
    constexpr const char* all = "streams";
    RAYPAGER_TRY(get_kernels({{begin_, all, "rp_begin_round"},
                              {wake_, all, "rp_wake_stream"},
                              {generate_, all, "rp_generate_stream"},
                              {trace_, all, "rp_trace_stream"},
                              {shade_, all, "rp_shade"}},
                             geometry_.definitions() + notes + shading_ + " -DRP_SHADE_LANES=16"));
    return shade_.set(params_buffer_, materials_, lights_, light_steps_, ranges_, queue_, status_, paths_, counters_, film_);
}

Status Wavefront::build_stages(const std::string& notes) {
    const DeviceProfile& profile = device_.profile();
    const std::string between = fmt::format(" -DRP_WAKE_GROUP={} -DRP_WAKE_NAPS={} -DRP_SHADE_LANES=1", device_.group_size(), profile.wake_naps);
    RAYPAGER_TRY(get_kernels({{publish_, "publish", "rp_publish"}}, ""));
    const std::string states = short_states, tracing = notes + (visit_settings_.capacity ? " -DRP_RECORD" : "");
    const std::string common = device_.register_limit(profile.shading_registers) + geometry_.definitions() + states + between;
    RAYPAGER_TRY(get_kernels({{wake_, "wake", "rp_wake"}, {generate_, "generate", "rp_generate"}, {advance_, "generate", "rp_advance"}}, common));
    RAYPAGER_TRY(get_kernels({{shade_, "shade", "rp_shade"}}, common + shading_));
    // Persistent threads do not record.
    persistent_ = visit_settings_.capacity == 0 && device_.has_persistent_threads();
    const auto trace = [&](Kernel& kernel, const char* stage, uint32_t registers, const std::string& more) -> Status {
        auto traced = geometry_.kernel(device_, stage, registers, tracing + more);
        if (traced) kernel = std::move(*traced);
        return traced.status();
    };
    RAYPAGER_TRY(trace(extend_, "extend", profile.closest_hit_registers, states + (persistent_ ? device_.camera_definitions() : "")));
    if (persistent_) RAYPAGER_TRY(trace(extend_bounces_, "extend", profile.closest_hit_registers, states + device_.bounce_definitions()));
    RAYPAGER_TRY(trace(connect_, "connect", profile.any_hit_registers, ""));
    return geometry_.set(shade_, params_buffer_, materials_, lights_, light_steps_, ranges_, queue_, status_, paths_, counters_, film_);
}

Status Wavefront::set_tracing_arguments(Kernel& extend, uint32_t round) {
    const uint32_t slots = params_.slot_count;
    if (visit_settings_.capacity == 0) {
        RAYPAGER_TRY(geometry_.set(extend, round, slots, queue_, status_, paths_, counters_));
        return geometry_.set(connect_, round, slots, queue_, status_, paths_, counters_, film_);
    }
    RAYPAGER_TRY(device_.kernels().fill_zero(visits_, RP_VISIT_RESERVED * sizeof(uint32_t), sizeof(uint32_t)));
    RAYPAGER_TRY(geometry_.set(extend, round, slots, queue_, status_, paths_, counters_, visits_));
    return geometry_.set(connect_, round, slots, queue_, status_, paths_, counters_, film_, visits_);
}

void Wavefront::fill_together(uint32_t slots) {
    RAYPAGER_CHECK(slots == 1 || slots == 2 || slots == 4 || slots == 8);
    filled_together_ = slots;
}

Status Wavefront::launch_streams(uint32_t round, std::span<const rp_page> page_changes, std::span<const uint32_t> newly_published, Flight& flight) {
    const uint32_t slots = params_.slot_count, blocks = geometry_.block_count(), cores = device_.info().compute_units;
    Queue& queue = device_.kernels();
    const std::vector<RoundBegin> begins = round_begins(page_changes, newly_published);
    for (const RoundBegin& begin : begins) {
        RAYPAGER_TRY(
            begin_.set(status_, geometry_.pages(), blocks, slots, awake_, counters_, geometry_.demand(), begin.named, begin.names, begin.changes));
        RAYPAGER_TRY(queue.launch(begin_, &begin == &begins.back() ? wake_items() : 1, 1, &flight.begin));
    }
    RAYPAGER_TRY(wake_.set(status_, slots, awake_, queue_, free_list_, counters_, block_scale(blocks, RP_BUNDLES)));
    RAYPAGER_TRY(queue.launch(wake_, wake_items(), 1, &flight.stages[0]));
    const uint32_t group = device_.group_size();
    RAYPAGER_TRY(queue.launch(generate_, uint64_t{cores} * device_.profile().generate_groups * group, group, &flight.stages[1]));
    RAYPAGER_TRY(geometry_.set(trace_, round, slots, queue_, status_, paths_, counters_, film_));
    RAYPAGER_TRY(geometry_.launch(device_, queue, trace_, slots, &flight.stages[2]));
    return queue.launch(shade_, uint64_t{cores} * device_.profile().shade_items, 1, &flight.stages[3]);
}

Status Wavefront::launch_stages(uint32_t round, std::span<const rp_page> page_changes, std::span<const uint32_t> newly_published, Flight& flight) {
    const uint32_t slots = params_.slot_count, blocks = geometry_.block_count(), group = device_.group_size();
    const uint32_t items = std::min(slots, device_.info().compute_units * device_.profile().items), naps_an_item = device_.profile().wake_naps;
    Queue& queue = device_.kernels();
    while (!page_changes.empty()) {
        RAYPAGER_TRY(publish_.set(geometry_.pages(), take_changes(page_changes)));
        RAYPAGER_TRY(queue.launch(publish_, 1, 1));
    }
    RAYPAGER_TRY(queue.fill_zero(counters_, 0, RP_COUNTERS_PER_ROUND * sizeof(uint32_t)));
    if (notes_.bounces)
        RAYPAGER_TRY(
            queue.fill_zero(geometry_.demand(), uint64_t{RP_DEMAND_BOUNCES} * blocks * sizeof(uint32_t), uint64_t{blocks} * sizeof(uint32_t)));
    // Camera rays are all there is in the first round.
    Kernel& extend = persistent_ && round > 1 ? extend_bounces_ : extend_;
    RAYPAGER_TRY(set_tracing_arguments(extend, round));
    RAYPAGER_TRY(advance_.set(params_buffer_, counters_, geometry_.pages(), blocks, geometry_.demand(), listed_again_));
    const uint32_t bit_scale = nap_bit_scale(blocks);
    // While visits are recorded, a ray that finds no room in the log waits although its block is there.
    const cl_ulong came = visit_settings_.capacity == 0 ? nap_bits(newly_published, bit_scale) : all_nap_bits;
    RAYPAGER_TRY(wake_.set(status_, geometry_.pages(), slots, queue_, free_list_, counters_, naps_, bit_scale, came, filled_together_));
    RAYPAGER_TRY(queue.launch(wake_, (nap_count(slots) + naps_an_item - 1) / naps_an_item, group, &flight.stages[0]));
    // Shadow rays beside extension rays: each stage has long waits for its last rays, and with few rays nothing else. What one writes the other does
    // not read: their slots are different ones.
    if (connects_beside()) {
        RAYPAGER_TRY(queue.flush());
        RAYPAGER_TRY(device_.beside().wait_for(flight.stages[0]));
        RAYPAGER_TRY(geometry_.launch(device_, device_.beside(), connect_, slots, &flight.stages[4]));
        RAYPAGER_TRY(device_.beside().flush());
    }
    RAYPAGER_TRY(queue.launch(generate_, items, group, &flight.stages[1]));
    RAYPAGER_TRY(queue.launch(advance_, std::max<uint32_t>(blocks, 1), group));
    if (persistent_)
        RAYPAGER_TRY(queue.launch(extend, std::min<uint64_t>(items, device_.persistent_items()), group, &flight.stages[2]));
    else
        RAYPAGER_TRY(geometry_.launch(device_, queue, extend, slots, &flight.stages[2]));
    RAYPAGER_TRY(queue.launch(shade_, items, group, &flight.stages[3]));
    return connects_beside() ? queue.wait_for(flight.stages[4]) : geometry_.launch(device_, queue, connect_, slots, &flight.stages[4]);
}

Status Wavefront::start_round(uint32_t round, std::span<const rp_page> page_changes, std::span<const uint32_t> newly_published) {
    RAYPAGER_CHECK(started_ - finished_ < most_rounds);
    Flight& flight = flights_[started_++ % most_rounds];
    Queue& queue = device_.kernels();
    RAYPAGER_TRY(list_samples_again());
    const uint32_t later = samples_again().size() > listed_again_ ? 1 : 0;
    RAYPAGER_TRY(generate_.set(params_buffer_, counters_, free_list_, status_, paths_, queue_, again_, listed_again_, later));
    RAYPAGER_TRY(as_on_cpus() ? launch_streams(round, page_changes, newly_published, flight)
                              : launch_stages(round, page_changes, newly_published, flight));
    const std::span<std::byte> results = flight.results.bytes();
    RAYPAGER_TRY(queue.read(counters_, 0, results.first(counters_.bytes()), &flight.read));
    RAYPAGER_TRY(queue.read(geometry_.demand(), 0, results.subspan(counters_.bytes()), &flight.read));
    return queue.flush();
}

Status Wavefront::finish_round(RoundCounters& counters, std::span<const uint32_t>& demand) {
    RAYPAGER_CHECK(finished_ < started_);
    Flight& flight = flights_[finished_++ % most_rounds];
    RAYPAGER_TRY(flight.read.wait());
    // What comes behind an event of another queue may run even if that ended badly.
    if (connects_beside()) RAYPAGER_TRY(flight.stages[4].wait());
    const std::span<std::byte> results = flight.results.bytes();
    std::memcpy(counters.words.data(), results.data(), counters_.bytes());
    demand = {reinterpret_cast<const uint32_t*>(results.data() + counters_.bytes()), uint64_t{geometry_.block_count()} * RP_DEMAND_ARRAYS};
    if (as_on_cpus()) RAYPAGER_TRY(check_lists(counters, demand));
    begun_again_ += std::min(listed_again_, counters.free_slots());
    std::array<uint64_t, 5> ns;
    for (size_t i = 0; i < ns.size(); i++) ns[i] = flight.stages[i].duration_ns();
    ns[0] += flight.begin.duration_ns();
    for (size_t i = 0; i < ns.size(); i++) stage_ns_[i] += ns[i];
    if (connects_beside()) beside_ns_ += std::min(ns[1] + ns[2] + ns[3], ns[4]);
    return {};
}

// Both say how many rays wait, and change where they begin to and where they are roused. A want that nobody has would bring blocks in for ever.
Status Wavefront::check_lists(const RoundCounters& counters, std::span<const uint32_t> demand) const {
    uint64_t wants = 0;
    for (const uint32_t of_block : demand.subspan(uint64_t{RP_DEMAND_WANTS} * geometry_.block_count(), geometry_.block_count())) wants += of_block;
    if (wants == counters.words[RP_COUNT_IN_LISTS]) return {};
    return Status::failed(fmt::format("{} rays wait, but blocks are wanted by {}; this is a bug", counters.words[RP_COUNT_IN_LISTS], wants));
}

Status Wavefront::read_visits(std::vector<uint32_t>& words) {
    RAYPAGER_CHECK(visit_settings_.capacity > 0);
    uint32_t reserved = 0;
    RAYPAGER_TRY(device_.kernels().read_now(visits_, RP_VISIT_RESERVED * sizeof(uint32_t), std::as_writable_bytes(std::span(&reserved, 1))));
    words.resize(size_t{RP_VISIT_WORDS} * std::min(reserved, visit_settings_.capacity));
    if (words.empty()) return {};
    return device_.kernels().read_now(visits_, RP_VISIT_HEADER * sizeof(uint32_t), std::as_writable_bytes(std::span(words)));
}

Status Wavefront::set_sample_limit(uint64_t limit) {
    RAYPAGER_CHECK(started_ == finished_);
    params_.sample_limit = limit;
    return device_.kernels().write_now(params_buffer_, 0, bytes_of_one(params_));
}

}  // namespace raypager
