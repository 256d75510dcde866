#include "wavefront/wavefront.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "base/check.hpp"
#include "lights/image_words.hpp"
#include "lights/light_choice.hpp"
#include "raypager/abi/film.h"
#include "scene/light_images.hpp"
#include "texture/texture_words.hpp"
#include "wavefront/single_ray_backend.hpp"
#include "wavefront/stream_backend.hpp"

namespace raypager {
namespace {

// Of the queue, the free list and the list of samples to be traced again.
constexpr uint64_t list_bytes_per_slot = 2 * sizeof(uint32_t) + 1;

// The list of samples to be traced again has one place for eight slots: a resumed render has all its paths under way after eight rounds.
constexpr uint64_t again_bytes(uint64_t slots) { return 16 + slots / 16 * 16; }

constexpr uint64_t extra_queue_words(BlockForm form) { return form == BlockForm::wide ? StreamBackend::extra_queue_words : 0; }

constexpr uint64_t backend_bytes_per_slot(BlockForm form) {
    return form == BlockForm::wide ? StreamBackend::bytes_per_slot : SingleRayBackend::bytes_per_slot;
}
constexpr uint64_t backend_fixed_bytes(BlockForm form) {
    return form == BlockForm::wide ? StreamBackend::fixed_bytes : SingleRayBackend::fixed_bytes;
}

bool has_lens(const rp_camera& camera) { return camera.focal_distance > 0; }

// Rays of the camera begin in more than one place.
bool eye_moves(const rp_camera& camera) { return has_lens(camera) || camera.projection == RP_PROJECTION_ORTHOGRAPHIC; }

// A pinhole camera and samples that lie evenly in their pixels take none.
std::string camera_definitions(const rp_render_params& params) {
    std::string result;
    if (params.camera.projection != RP_PROJECTION_PERSPECTIVE) result += fmt::format(" -DRP_PROJECTION={}", params.camera.projection);
    if (has_lens(params.camera)) result += " -DRP_LENS";
    if (params.filter.radius[0] > 0) result += " -DRP_PIXEL_FILTER";
    return result;
}

template <class T>
std::span<const std::byte> bytes_of_one(const T& value) {
    return std::as_bytes(std::span(&value, 1));
}

}  // namespace

namespace {

uint64_t light_words_bytes(const BakedScene& scene) {
    return light_choice_bytes(scene.lights) + image_words_bytes(scene.light_images, scene.lights, scene.sky_words);
}

uint64_t texture_bytes(const BakedScene& scene) { return scene.has_textures() ? at_least_16(texture_words_bytes(scene)) : 0; }

// Traits of instances lie behind the ranges (kernels/shading/instance_traits.cl).
uint64_t range_bytes(const BakedScene& scene) {
    return scene.ranges.size() * sizeof(rp_primitive_range) + scene.instance_traits.size() * sizeof(rp_instance_traits);
}
std::vector<std::byte> ranges_and_traits(const BakedScene& scene) {
    std::vector<std::byte> bytes;
    bytes.reserve(range_bytes(scene));
    for (const auto part : {std::as_bytes(std::span(scene.ranges)), std::as_bytes(std::span(scene.instance_traits))})
        bytes.insert(bytes.end(), part.begin(), part.end());
    return bytes;
}

// What kernels that shade must know.
std::string shading_definitions(const BakedScene& scene) {
    std::string result;
    const auto any = [&](const auto& condition) { return std::ranges::any_of(scene.lights, condition); };
    if (has_light_tree(scene.lights)) {
        result += " -DRP_LIGHT_TREE";
        if (any([](const rp_light& l) { return l.kind == RP_LIGHT_POINT || l.kind >= RP_LIGHT_SPOT; })) result += " -DRP_LIGHT_CLOSE";
    }
    if (any([](const rp_light& light) { return light.kind == RP_LIGHT_INFINITE && image_of(light); })) result += " -DRP_SKY";
    if (scene.has_paged_sky()) result += " -DRP_SKY_PAGED";
    if (any([](const rp_light& l) { return l.kind >= RP_LIGHT_SPOT || (l.kind == RP_LIGHT_POINT && image_of(l)); })) result += " -DRP_LAMPS";
    if (std::ranges::any_of(scene.materials, [](const rp_material& m) { return m.kind > RP_MATERIAL_ABSORBING; })) result += " -DRP_LAYERED";
    if (std::ranges::any_of(scene.texture_ops, [](const rp_texture_op& op) {
            const uint32_t kind = op.op & RP_TEXTURE_OPERATION_MASK;
            return kind == RP_TEXTURE_DOTS || (kind >= RP_TEXTURE_FBM && kind <= RP_TEXTURE_MARBLE);
        }))
        result += " -DRP_NOISE";
    if (scene.has_bumps()) result += " -DRP_BUMPS";
    if (scene.is_anisotropic()) result += " -DRP_ANISOTROPIC";
    return result;
}

}  // namespace

WavefrontBytes wavefront_bytes(const BakedScene& scene, BlockForm form, uint32_t width, const FilmLayout& film) {
    const SlotFields fields = SlotFields::of(scene, film);
    WavefrontBytes bytes;
    bytes.scene = at_least_16(sizeof(rp_render_params)) + at_least_16(scene.materials.size() * sizeof(rp_material)) +
                  at_least_16(scene.lights.size() * sizeof(rp_light)) + at_least_16(light_words_bytes(scene)) + texture_bytes(scene) +
                  at_least_16(range_bytes(scene)) + GeometryBuffers::bytes(scene, form) + RP_COUNTER_WORDS * sizeof(uint32_t) + again_bytes(0) +
                  RoundReports::bytes(scene.pageable_count()) + backend_fixed_bytes(form) + PathSlots::fixed_bytes(fields) +
                  (film.adaptive() ? 0 : 16) + extra_queue_words(form) * sizeof(uint32_t);
    bytes.film_row = width * (film.words() * sizeof(uint32_t) + (film.adaptive() ? sizeof(uint32_t) : 0));
    bytes.per_slot = PathSlots::bytes_per_slot(fields) + list_bytes_per_slot + backend_bytes_per_slot(form);
    bytes.largest_part_per_slot = PathSlots::largest_part_per_slot(fields);
    return bytes;
}

std::string BlockNotes::definitions(BlockForm form, uint32_t slots) const {
    std::string result = bounces ? " -DRP_TRACK_BOUNCES" : "";
    if (use == Use::last_round) result += " -DRP_TRACK_LAST_ROUND";
    // Of single rays a sample is enough to tell blocks apart, and costs nothing. Each number has kernels of its own, so there are not many.
    const int counted = form == BlockForm::wide || slots < 1u << 18 ? 1 : slots < 1u << 22 ? 8 : 256;
    // Streams ask as they enter a block, so that kernels are the same whether all of a scene is resident or not.
    if (use == Use::entries || (use == Use::none && form == BlockForm::wide)) result += fmt::format(" -DRP_TRACK_ENTERS={}u", counted - 1);
    return result;
}

Result<std::unique_ptr<Wavefront>> Wavefront::create(Device& device, const BakedScene& scene, BlockForm form, const rp_render_params& params,
                                                     const std::vector<Buffer>& slabs, const Buffer& page_table, uint32_t filled_together,
                                                     const BlockNotes& notes, const VisitLogSettings& visits) {
    RAYPAGER_CHECK(form == BlockForm::stored || visits.capacity == 0);
    RAYPAGER_CHECK(params.slot_count > 0 && uint64_t{params.width} * params.film_rows > 0 && params.film_rows <= params.height);
    const FilmLayout film(params);
    auto geometry = GeometryBuffers::create(device, scene, form, slabs, page_table, true, film.definitions());
    if (!geometry) return geometry.status();
    std::unique_ptr<Wavefront> wavefront(new Wavefront(device, params, std::move(*geometry)));
    RAYPAGER_TRY(wavefront->upload_scene(scene));
    RAYPAGER_TRY(wavefront->allocate_state(SlotFields::of(scene, film)));
    BackendSettings settings;
    const BlockNotes kept = scene.pageable_count() == 0 ? BlockNotes() : notes;
    settings.tracing = kept.definitions(form, params.slot_count);
    settings.notes = kept.use != BlockNotes::Use::none;
    settings.textures = scene.has_textures();
    settings.shading = shading_definitions(scene);
    settings.cameras = camera_definitions(params) + (film.adaptive() ? " -DRP_ADAPTIVE" : "");
    if (eye_moves(params.camera)) settings.single_rays = " -DRP_EYE_MOVES";
    Wavefront& w = *wavefront;
    auto backend = form == BlockForm::wide ? StreamBackend::create(device, w.params_, w.geometry_, w.buffers_, settings)
                                           : SingleRayBackend::create(device, w.params_, w.geometry_, w.buffers_, settings, visits);
    if (!backend) return backend.status();
    wavefront->backend_ = std::move(*backend);
    wavefront->fill_together(filled_together);
    RAYPAGER_TRY(wavefront->build_count_waits());
    return wavefront;
}

Status Wavefront::build_count_waits() {
    if (!film_layout().layers().has(FilmLayer::waits)) return {};
    auto kernel = device_.kernel(
        {"shading/count_waits", "rp_count_waits", geometry_.definitions() + (geometry_.form() == BlockForm::stored ? short_states : "")});
    if (!kernel) return kernel.status();
    count_waits_ = std::move(*kernel);
    return count_waits_->set(params_.slot_count, buffers_.params, buffers_.slots.status(), buffers_.slots.planes(), buffers_.film);
}

Status Wavefront::upload_scene(const BakedScene& scene) {
    RAYPAGER_TRY(upload_textures(scene));
    std::vector<rp_light> lights = scene.lights;
    RAYPAGER_TRY(upload_light_words(scene, lights));
    const std::vector<std::byte> ranges = ranges_and_traits(scene);
    struct Part {
        Buffer& buffer;
        std::span<const std::byte> contents;
        const char* what;
    };
    const Part parts[] = {{buffers_.params, bytes_of_one(params_), "render parameters"},
                          {buffers_.materials, bytes_of(scene.materials), "materials"},
                          {buffers_.lights, bytes_of(lights), "lights"},
                          {buffers_.ranges, ranges, "primitive ranges and traits of instances"}};
    for (const Part& part : parts) {
        auto buffer = device_.upload(part.contents, part.what);
        if (!buffer) return buffer.status();
        part.buffer = std::move(*buffer);
    }
    return {};
}

// Before the parameters, which say where its tables are.
Status Wavefront::upload_textures(const BakedScene& scene) {
    if (!scene.has_textures()) return {};
    const TextureWords textures = texture_words(scene);
    params_.textures.first_page = static_cast<uint32_t>(scene.blocks.size());
    params_.textures.images = textures.images_at;
    params_.textures.image_levels = textures.levels_at;
    params_.textures.ops = textures.ops_at;
    params_.textures.maps = textures.maps_at;
    auto buffer = device_.upload(bytes_of(textures.words), "the tables of textures");
    if (!buffer) return buffer.status();
    buffers_.textures = std::move(*buffer);
    return {};
}

// Piece by piece: images may be large.
Status Wavefront::upload_light_words(const BakedScene& scene, std::vector<rp_light>& lights) {
    const std::vector<uint32_t> choice = light_choice(lights);
    auto buffer = device_.allocate(at_least_16(light_words_bytes(scene)), "the choice of lights and their images");
    if (!buffer) return buffer.status();
    buffers_.light_steps = std::move(*buffer);
    uint64_t written = 0;
    const auto write = [&](std::span<const std::byte> bytes) -> Status {
        if (bytes.empty()) return {};
        RAYPAGER_TRY(device_.kernels().write_now(buffers_.light_steps, written, bytes));
        written += bytes.size();
        return {};
    };
    RAYPAGER_TRY(write(bytes_of(choice)));
    return for_image_words(
        scene.light_images, lights, choice.size(),
        [&](std::span<const uint32_t> head, std::span<const rp_texel> texels) -> Status {
            RAYPAGER_TRY(write(std::as_bytes(head)));
            return write(std::as_bytes(texels));
        },
        scene.sky_words);
}

Status Wavefront::allocate_state(const SlotFields& fields) {
    const uint64_t slots = params_.slot_count;
    auto path_slots = PathSlots::create(device_, params_.slot_count, geometry_.form(), fields);
    if (!path_slots) return path_slots.status();
    WavefrontBuffers& b = buffers_;
    b.slots = std::move(*path_slots);
    struct Part {
        Buffer& buffer;
        uint64_t bytes;
        const char* what;
    };
    const Part parts[] = {
        {b.film, uint64_t{params_.width} * params_.film_rows * film_layout().words() * sizeof(uint32_t), "the film"},
        {b.queue, (slots + extra_queue_words(geometry_.form())) * sizeof(uint32_t), "the ray queue"},
        {b.free_list, slots * sizeof(uint32_t), "the free list"},
        {b.again, again_bytes(slots), "samples to trace again"},
        {b.stage_pixels, film_layout().adaptive() ? uint64_t{params_.width} * params_.height * sizeof(uint32_t) : 16, "pixels of a stage"},
        {b.counters, RP_COUNTER_WORDS * sizeof(uint32_t), "counters"}};
    for (const Part& part : parts) {
        auto buffer = device_.allocate(part.bytes, part.what);
        if (!buffer) return buffer.status();
        part.buffer = std::move(*buffer);
    }
    RAYPAGER_TRY(b.slots.clear(device_.kernels()));
    for (const Buffer* buffer : {&b.film, &b.counters}) RAYPAGER_TRY(device_.kernels().fill_zero(*buffer, 0, buffer->bytes()));
    return b.reports.allocate(device_, geometry_.block_count());
}

Status Wavefront::start_round(uint32_t number, std::span<const rp_page> page_changes, std::span<const uint32_t> newly_published) {
    RAYPAGER_CHECK(started_ - finished_ < max_rounds);
    const uint32_t report = started_++ % max_rounds;
    Queue& queue = device_.kernels();
    RAYPAGER_TRY(list_samples_again());
    const rp_sample_numbers numbers = numbers_.for_round(samples_begun_);
    const bool more = samples_again().size() > listed_again_ || expects_more_ || numbers.end < numbers_.count();
    may_have_idle_slots_ = may_have_idle_slots_ || !more;
    const Round round = {number, page_changes, newly_published, numbers, listed_again_, more, report};
    RAYPAGER_TRY(backend_->launch(round, events_[report]));
    if (count_waits_) {
        const uint64_t items = uint64_t{device_.info().compute_units} * device_.profile().items;
        RAYPAGER_TRY(queue.launch(*count_waits_, std::min<uint64_t>(params_.slot_count, items), device_.group_size()));
    }
    RAYPAGER_TRY(buffers_.reports.begin_read(report));
    return queue.flush();
}

Status Wavefront::finish_round(RoundCounters& counters, std::span<const rp_block_demand>& demand) {
    RAYPAGER_CHECK(finished_ < started_);
    const uint32_t report = finished_++ % max_rounds;
    RAYPAGER_TRY(buffers_.reports.read(report).wait());
    const StageEvents& events = events_[report];
    // What comes behind an event of another queue may run even if that ended badly.
    if (backend_->connects_concurrently()) RAYPAGER_TRY(events.connect.wait());
    RAYPAGER_TRY(buffers_.reports.finish_read(report, counters, demand));
    RAYPAGER_TRY(backend_->check_round(counters, demand));
    samples_begun_ = counters.samples_begun();
    begun_again_ += std::min(listed_again_, counters.free_slots());
    add_times(events);
    return {};
}

void Wavefront::add_times(const StageEvents& events) {
    const std::array<std::pair<Event::Interval, size_t>, 6> parts = {std::pair{events.begin.interval(), size_t{0}},
                                                                     {events.wake.interval(), 0},
                                                                     {events.generate.interval(), 1},
                                                                     {events.extend.interval(), 2},
                                                                     {events.shade.interval(), 3},
                                                                     {events.connect.interval(), 4}};
    std::array<Event::Interval, 6> in_order;
    uint64_t sum = 0, busy = 0;
    for (size_t i = 0; i < parts.size(); i++) {
        const auto& [interval, stage] = parts[i];
        in_order[i] = interval;
        stage_ns_[stage] += interval.end - interval.begin;
        sum += interval.end - interval.begin;
    }
    std::ranges::sort(in_order, {}, &Event::Interval::begin);
    uint64_t end = 0;
    for (const Event::Interval& interval : in_order) {
        busy += std::max(end, interval.end) - std::max(end, interval.begin);
        end = std::max(end, interval.end);
    }
    concurrent_ns_ += sum - busy;
    const uint64_t since_last = last_end_ > 0 && end > last_end_ ? end - last_end_ : 0;
    idle_ns_ = since_last - std::min(since_last, busy);
    last_end_ = end;
}

Status Wavefront::wake_idle_slots() {
    RAYPAGER_CHECK(started_ == finished_);
    if (!may_have_idle_slots_) return {};
    RAYPAGER_TRY(buffers_.slots.free_idle(device_.kernels()));
    may_have_idle_slots_ = false;
    return backend_->wake_all_slots();
}

Status Wavefront::move_film(uint32_t first_row) {
    RAYPAGER_CHECK(started_ == finished_ && first_row < params_.height);
    params_.film_first_row = first_row;
    return device_.kernels().write_now(buffers_.params, 0, bytes_of_one(params_));
}

Status Wavefront::begin_stage(uint64_t begin, uint32_t first, uint32_t passes, std::span<const uint32_t> pixels) {
    RAYPAGER_CHECK(started_ == finished_ && film_layout().adaptive() && pixels.size() <= buffers_.stage_pixels.bytes() / sizeof(uint32_t));
    if (!pixels.empty()) RAYPAGER_TRY(device_.kernels().write_now(buffers_.stage_pixels, 0, std::as_bytes(pixels)));
    params_.stage_begin = begin;
    params_.stage_first = first;
    params_.stage_passes = passes;
    return device_.kernels().write_now(buffers_.params, 0, bytes_of_one(params_));
}

}  // namespace raypager
