#include "render/render.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "base/check.hpp"
#include "base/log.hpp"
#include "base/memory.hpp"
#include "device/device.hpp"
#include "device/kernel_sources.hpp"
#include "film/film.hpp"
#include "raypager/abi/film.h"
#include "render/checkpointer.hpp"
#include "render/memory_plan.hpp"
#include "render/watchdog.hpp"
#include "residency/residency.hpp"
#include "wavefront/wavefront.hpp"

namespace raypager {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point begin) { return std::chrono::duration<double>(Clock::now() - begin).count(); }

// One render from start to end. run() is the loop; everything else serves it.
class Renderer {
public:
    Renderer(const BlockFile& file, const RenderOptions& options, const RenderCallbacks& callbacks)
        : file_(file), scene_(file.scene()), options_(options), callbacks_(callbacks) {}

    Result<RenderResult> run() {
        RAYPAGER_TRY(prepare());
        if (Status status = render_rounds(); !status.ok()) return with_advice(status);
        auto finished = result();
        if (!finished) return with_advice(finished.status());
        return finished;
    }

private:
    Status render_rounds() {
        while (!finished() && !stopped_) {
            while (rounds_under_way() < rounds_wanted()) RAYPAGER_TRY(start_round());
            RAYPAGER_TRY(finish_round());
            RAYPAGER_TRY(residency_->after_round(ended_, started_, wavefront_->last_round_end(), demand_, ready_rays(), slots()));
            watchdog_->round_ended(round_state());
            if (nothing_to_trace() && rounds_under_way() == 0) RAYPAGER_TRY(wait_for_block());
            RAYPAGER_TRY(end_early());
            if (checkpointer_->due()) RAYPAGER_TRY(keep_checkpoint());
            RAYPAGER_TRY(tell());
        }
        RAYPAGER_TRY(settle());
        return checkpointer_->enabled() ? keep_checkpoint() : Status();
    }

    Status prepare();
    Status make_device_state(rp_render_params params, uint64_t memory_limit);
    Result<rp_render_params> make_params() const;
    Status check_picture_size(const rp_render_params& params) const;
    void adapt_loads(PolicySettings& policy, uint64_t pool_bytes) const;
    uint32_t slots() const { return wavefront_->params().slot_count; }
    uint32_t rounds_under_way() const { return started_ - ended_; }
    // A GPU gets its next round before the host has seen what the last one did; a CPU works on rounds and host code with the same cores.
    uint32_t rounds_wanted() const {
        if (nothing_to_trace() || wavefront_->begins_again()) return 1;
        return options_.rounds_under_way ? options_.rounds_under_way : device_->info().type == "CPU" ? 1 : Wavefront::most_rounds;
    }
    Status start_round();
    Status finish_round();
    Status settle();
    uint32_t ready_rays() const { return counters_.extend_rays() + counters_.shadow_rays(); }
    bool finished() const { return counters_.idle_slots() == slots(); }
    // Rays there are, but all wait for blocks; or none, and then the next round starts new paths or ends the render.
    bool nothing_to_trace() const { return ready_rays() == 0 && counters_.waiting_rays() > 0; }
    Status wait_for_block();
    Status end_early();
    Status keep_checkpoint();
    Status tell();
    void warn(const std::string& message) const;
    Status with_advice(const Status& error) const;
    WorkDone work() const;
    RoundState round_state() const { return make_round_state(ended_, counters_, *residency_); }
    RenderProgress progress() const;
    Result<FilmResolver> read_film();
    Result<RenderResult> result();

    const BlockFile& file_;
    const BakedScene& scene_;
    const RenderOptions& options_;
    const RenderCallbacks& callbacks_;
    std::unique_ptr<Device> device_;
    std::unique_ptr<Residency> residency_;
    std::unique_ptr<Wavefront> wavefront_;
    std::optional<Checkpointer> checkpointer_;
    std::unique_ptr<Watchdog> watchdog_;  // asks residency_: destroyed before it
    RoundCounters counters_;
    std::span<const uint32_t> demand_;
    WorkDone earlier_;  // by runs before this one
    uint64_t pixels_ = 0, host_limit_ = 0, planned_bytes_ = 0;
    uint32_t started_ = 0, ended_ = 0;       // rounds, numbered from 1
    bool ending_ = false, stopped_ = false;  // with the pass under way; at once
    double stall_seconds_ = 0;
    Clock::time_point start_ = Clock::now(), render_start_ = start_;
    double next_progress_ = 0, next_snapshot_ = 0, last_told_ = 0;
    uint64_t last_rays_ = 0;
    mutable double rate_ = 0;
};

// Half of the memory that is free now, for the cache of stored blocks; device_bytes will be taken out of it, too (on a CPU).
uint64_t default_host_limit(uint64_t device_bytes) {
    const uint64_t available = available_memory();
    return available > device_bytes ? (available - device_bytes) / 2 : 0;
}

// Path slots that keep a device busy while everything is resident.
uint64_t default_slots(const DeviceInfo& info) {
    if (info.type == "CPU") return std::max<uint64_t>(uint64_t{1} << 16, info.compute_units * (uint64_t{1} << 15));
    return std::clamp<uint64_t>(info.compute_units * (uint64_t{1} << 15), uint64_t{1} << 18, uint64_t{1} << 22);
}

// A film pixel holds so many samples of any radiance (abi/film.h).
constexpr uint32_t max_spp = 65535;

void set3(float (&target)[4], const Float3& value) {
    target[0] = value.x;
    target[1] = value.y;
    target[2] = value.z;
    target[3] = 0;
}

Result<rp_render_params> Renderer::make_params() const {
    rp_render_params params = {};
    const Camera& camera = options_.camera ? *options_.camera : scene_.camera;
    set3(params.camera.eye, camera.eye);
    set3(params.camera.right, camera.right);
    set3(params.camera.up, camera.up);
    set3(params.camera.forward, camera.forward);
    params.width = options_.width ? options_.width : scene_.width;
    params.height = options_.height ? options_.height : scene_.height;
    // With a time limit alone, the time decides.
    params.spp = options_.spp ? options_.spp : options_.time_seconds > 0 ? max_spp : scene_.spp;
    params.max_depth = options_.max_depth ? *options_.max_depth : scene_.max_depth;
    params.seed = options_.seed;
    params.light_count = static_cast<uint32_t>(scene_.lights.size());
    params.range_count = static_cast<uint32_t>(scene_.ranges.size());
    params.infinite_light = RP_NONE;
    for (uint32_t i = 0; i < scene_.lights.size(); i++)
        if (scene_.lights[i].kind == RP_LIGHT_INFINITE) params.infinite_light = i;
    params.roulette_connection = options_.connection == Connection::roulette;
    params.tile_size = 16;
    const uint64_t pixels = uint64_t{params.width} * params.height;
    constexpr uint32_t longest_side = 1 << 24;
    if (params.width > longest_side || params.height > longest_side)
        return Status::usage(fmt::format("--size: at most {} pixels a side", longest_side));
    if (pixels == 0 || pixels > uint64_t{1} << 31)
        return Status::usage(fmt::format("--size {}x{}: between 1 and 2^31 pixels are possible", params.width, params.height));
    if (params.spp == 0 || params.spp > max_spp) return Status::usage(fmt::format("--spp {}: from 1 to {}", params.spp, max_spp));
    if (params.max_depth > 60000) return Status::usage("--max-depth: at most 60000");
    params.sample_limit = pixels * params.spp;
    return params;
}

// Loads between two rounds. Each round has a cost of its own, so small blocks come several at a time; but no more than a part of the
// pool (two are always allowed), for what is on its way serves no ray yet. The paper's policy swaps one block a round.
void Renderer::adapt_loads(PolicySettings& policy, uint64_t pool_bytes) const {
    if (policy.kind != PolicyKind::most_wanted && !scene_.blocks.empty()) {
        const uint64_t average = std::max<uint64_t>(1, scene_.geometry_bytes() / scene_.blocks.size());
        // A GPU's rounds are short beside their fixed cost, and its bus is wide: more at a time.
        const bool cpu = device_->info().type == "CPU";
        policy.loads_in_flight = static_cast<uint32_t>(std::clamp<uint64_t>(pool_bytes / average / (cpu ? 16 : 4), 2, cpu ? 16 : 128));
        policy.loads_into_free = 256;
    }
    if (options_.loads_in_flight) policy.loads_in_flight = options_.loads_in_flight;
}

RenderIdentity identity_of(const BakedScene& scene, const rp_render_params& params) {
    RenderIdentity identity;
    identity.scene = scene.identity();
    identity.kernels = kernel_sources_identity();
    identity.width = params.width;
    identity.height = params.height;
    identity.max_depth = params.max_depth;
    identity.seed = params.seed;
    identity.roulette_connection = params.roulette_connection;
    identity.camera = params.camera;
    return identity;
}

// The film lies in one buffer on the device; the finished picture lies in host memory.
Status Renderer::check_picture_size(const rp_render_params& params) const {
    const uint64_t film = pixels_ * RP_FILM_WORDS * sizeof(uint32_t), most = device_->info().max_allocation_bytes;
    if (film > most)
        return Status::failed(
            fmt::format("--size {}x{}: the film needs {} bytes at once, but {} allocates at most {}; at most {} pixels are possible there",
                        params.width, params.height, film, device_->info().name, most, most / RP_FILM_WORDS / sizeof(uint32_t)));
    const uint64_t picture = pixels_ * 3 * sizeof(float), free = available_memory();
    if (picture > free)
        return Status::failed(fmt::format("--size {}x{}: the picture needs {} bytes of main memory, of which {} are free; render a smaller one",
                                          params.width, params.height, picture, free));
    return {};
}

Status Renderer::prepare() {
    auto params = make_params();
    if (!params) return params.status();
    pixels_ = uint64_t{params->width} * params->height;
    auto device = Device::open(options_.device, options_.memory_limit);
    if (!device) return device.status();
    device_ = std::move(*device);
    RAYPAGER_TRY(check_picture_size(*params));
    auto checkpointer =
        Checkpointer::create(options_.checkpoint, identity_of(scene_, *params), params->spp, device_->info().name + ", " + device_->info().driver);
    if (!checkpointer) return checkpointer.status();
    checkpointer_ = std::move(*checkpointer);
    if (checkpointer_->other_device()) warn("the checkpoint was written on another device or driver: the last bits of the picture may differ");
    params->first_sample = checkpointer_->first_sample();
    earlier_ = checkpointer_->earlier_work();

    const uint64_t allowed = device_->budget().limit();
    Status made = make_device_state(*params, allowed);
    // Another process may hold memory that the driver counts as ours: then with less, until the least that would do is refused, too.
    uint64_t refused = 0;
    while (!made && device_ && device_->refused_memory()) {
        refused = planned_bytes_;
        const uint64_t less = refused / 8 * 7;
        warn(fmt::format("{}; trying with {} bytes of device memory", made.message(), less));
        made = make_device_state(*params, less);
    }
    if (!made && refused > 0) return Status::failed(fmt::format("the device refused {} bytes; with less, {}", refused, made.message()));
    RAYPAGER_TRY(made);
    RAYPAGER_TRY(checkpointer_->restore(*wavefront_));
    const auto told = [this](const std::string& text) { warn(text); };
    watchdog_ = std::make_unique<Watchdog>(
        options_.stall_seconds, [this] { return residency_->loader_activity(); }, told);
    render_start_ = Clock::now();
    next_snapshot_ = options_.snapshot_seconds;
    return {};
}

// The device with everything on it, within a limit.
Status Renderer::make_device_state(rp_render_params params, uint64_t memory_limit) {
    wavefront_.reset();
    residency_.reset();
    if (device_->budget().limit() != memory_limit) {
        device_.reset();
        auto device = Device::open(options_.device, memory_limit);
        if (!device) return device.status();
        device_ = std::move(*device);
    }
    const WavefrontBytes bytes = wavefront_bytes(scene_, params.width, params.height);
    MemoryNeeds needs;
    needs.limit = device_->budget().limit();
    needs.fixed = bytes.scene + bytes.film + std::max<uint64_t>(scene_.blocks.size(), 1) * sizeof(rp_page) + RP_BLOCK_ALIGNMENT;
    needs.per_slot = bytes.per_slot;
    needs.geometry = scene_.geometry_bytes();
    needs.largest_block = scene_.largest_block();
    needs.geometry_limit = options_.geometry_limit;
    needs.geometry_limit_percent = options_.geometry_limit_percent;
    needs.requested_slots = options_.paths;
    needs.default_slots = default_slots(device_->info());
    needs.total_paths = params.sample_limit;
    needs.most_slots = device_->info().max_allocation_bytes / bytes.largest_part_per_slot;
    auto plan = plan_memory(needs);
    if (!plan) return plan.status();
    params.slot_count = static_cast<uint32_t>(plan->slots);

    ResidencySettings settings;
    settings.pool_bytes = plan->pool_bytes;
    settings.slab_bytes = options_.slab_bytes;
    planned_bytes_ = needs.fixed + plan->slots * needs.per_slot + plan->pool_bytes;
    host_limit_ = options_.host_limit ? options_.host_limit : default_host_limit(device_->info().type == "CPU" ? planned_bytes_ : 0);
    settings.host_limit = host_limit_;
    settings.loader_threads = options_.loader_threads;
    settings.policy = default_settings(options_.policy);
    adapt_loads(settings.policy, plan->pool_bytes);
    auto residency = Residency::create(*device_, file_, settings);
    if (!residency) return residency.status();
    residency_ = std::move(*residency);
    auto wavefront =
        Wavefront::create(*device_, scene_, params, residency_->slabs(), residency_->page_table(), options_.policy == PolicyKind::most_wanted);
    if (!wavefront) return wavefront.status();
    wavefront_ = std::move(*wavefront);
    return {};
}

Status Renderer::start_round() {
    if (++started_ == RP_ROUND_MASK) return Status::failed("more rounds than path slots can count; give more --paths");
    RAYPAGER_TRY(residency_->publish(device_->kernels()));
    return wavefront_->start_round(started_);
}

Status Renderer::finish_round() {
    watchdog_->doing("tracing");
    ended_++;
    return wavefront_->finish_round(counters_, demand_);
}

// Ends all rounds under way, so that the counters are those of the state on the device.
Status Renderer::settle() {
    while (rounds_under_way() > 0) RAYPAGER_TRY(finish_round());
    return {};
}

Status Renderer::wait_for_block() {
    watchdog_->doing("waiting for a block");
    const auto begin = Clock::now();
    auto arrived = residency_->wait_for_block(ended_);
    stall_seconds_ += seconds_since(begin);
    if (!arrived) return arrived.status();
    if (*arrived) return {};
    return Status::failed(
        fmt::format("no progress in round {}: rays wait for blocks, but none is on its way: {}; this is a bug", ended_, describe(round_state())));
}

// With a checkpoint, a stop from outside ends the render here and now. Otherwise it ends with the pass that is under way, as it does
// when time is up: no more camera paths after it, all paths finish.
Status Renderer::end_early() {
    const bool stop = options_.stop && options_.stop->load();
    stopped_ = stop && checkpointer_->enabled() && !finished();
    const bool late = options_.time_seconds > 0 && seconds_since(render_start_) >= options_.time_seconds;
    if (ending_ || stopped_ || !(stop || late)) return {};
    ending_ = true;
    RAYPAGER_TRY(settle());
    const uint64_t passes = std::max<uint64_t>(1, (counters_.next_sample() + pixels_ - 1) / pixels_);
    return wavefront_->set_sample_limit(std::min(wavefront_->params().sample_limit, passes * pixels_));
}

// A checkpoint that cannot be written is no reason to end: the disk may have room again the next time.
Status Renderer::keep_checkpoint() {
    RAYPAGER_TRY(settle());
    watchdog_->doing("writing the checkpoint");
    const Status status = checkpointer_->write(*wavefront_, counters_.next_sample(), work());
    if (!status) warn(status.message() + "; the checkpoint before it stays, and the render goes on");
    return {};
}

void Renderer::warn(const std::string& message) const {
    if (callbacks_.warning)
        callbacks_.warning(message);
    else
        log_warning(message);
}

// An error that ends a render does not end its checkpoint.
Status Renderer::with_advice(const Status& error) const {
    const std::string advice = checkpointer_->advice();
    return advice.empty() ? error : Status::failed(error.message() + "; " + advice);
}

WorkDone Renderer::work() const {
    WorkDone sum = earlier_;
    sum.render_seconds += seconds_since(render_start_);
    sum.stall_seconds += stall_seconds_;
    for (size_t i = 0; i < std::size(sum.stage_seconds); i++) sum.stage_seconds[i] += static_cast<double>(wavefront_->stage_nanoseconds()[i]) * 1e-9;
    sum.camera_rays += counters_.camera_rays();
    sum.bounce_rays += counters_.bounce_rays();
    sum.shadow_rays += counters_.total_shadow_rays();
    const PagingStatistics& paging = residency_->statistics();
    sum.loads += paging.loads;
    sum.evictions += paging.evictions;
    sum.bytes_loaded += paging.bytes_loaded;
    sum.rounds += ended_;
    sum.wants_without_hit += counters_.wants_without_hit();
    sum.runs++;
    return sum;
}

RenderProgress Renderer::progress() const {
    const WorkDone done = work();
    RenderProgress p;
    p.seconds = done.render_seconds;
    p.spp = static_cast<double>(counters_.next_sample()) / static_cast<double>(pixels_);
    const double by_samples = static_cast<double>(counters_.next_sample()) / static_cast<double>(wavefront_->params().sample_limit);
    const double by_time = options_.time_seconds > 0 ? p.seconds / (earlier_.render_seconds + options_.time_seconds) : 0;
    p.fraction = std::min(1.0, std::max(by_samples, by_time));
    p.rays = done.camera_rays + done.bounce_rays + done.shadow_rays;
    p.rays_per_second = rate_;
    p.loads = done.loads;
    p.bytes_loaded = done.bytes_loaded;
    p.resident_bytes = residency_->resident_bytes();
    p.geometry_bytes = scene_.geometry_bytes();
    return p;
}

Result<FilmResolver> Renderer::read_film() {
    FilmResolver film(wavefront_->params().width, wavefront_->params().height);
    std::vector<uint32_t> words(std::min(film_piece_words, wavefront_->film_words()));
    for (uint64_t first = 0; first < wavefront_->film_words(); first += film_piece_words) {
        const std::span<uint32_t> piece = std::span(words).first(std::min(film_piece_words, wavefront_->film_words() - first));
        RAYPAGER_TRY(wavefront_->read_film(first, piece));
        film.add(piece);
    }
    return film;
}

Status Renderer::tell() {
    const double now = seconds_since(render_start_);
    if (callbacks_.progress && now >= next_progress_) {
        next_progress_ = now + options_.progress_seconds;
        const uint64_t rays = counters_.camera_rays() + counters_.bounce_rays() + counters_.total_shadow_rays();
        if (now > last_told_) rate_ = static_cast<double>(rays - last_rays_) / (now - last_told_);
        last_told_ = now;
        last_rays_ = rays;
        callbacks_.progress(progress());
    }
    if (callbacks_.snapshot && options_.snapshot_seconds > 0 && now >= next_snapshot_) {
        watchdog_->doing("writing a snapshot");
        auto film = read_film();
        if (!film) return film.status();
        RenderProgress p = progress();
        p.spp = static_cast<double>(film->samples()) / static_cast<double>(pixels_);
        RAYPAGER_TRY(callbacks_.snapshot(film->take_image(), p));
        next_snapshot_ = seconds_since(render_start_) + options_.snapshot_seconds;
    }
    return {};
}

Result<RenderResult> Renderer::result() {
    const rp_render_params& params = wavefront_->params();
    auto film = read_film();
    if (!film) return film.status();
    const WorkDone done = work();
    RenderResult result;
    result.image = film->take_image();
    RenderReport& report = result.report;
    const DeviceInfo& info = device_->info();
    report.device = {info.name, info.platform, info.driver, info.type};
    report.limits = {device_->budget().limit(), residency_->pool_bytes(), host_limit_};
    report.peak = {device_->budget().peak(), residency_->statistics().peak_resident_bytes, residency_->host_peak_bytes()};
    report.width = params.width;
    report.height = params.height;
    report.complete = film->samples() == params.sample_limit;
    report.average_spp = static_cast<double>(film->samples()) / static_cast<double>(pixels_);
    report.spp = static_cast<uint32_t>(film->samples() / pixels_);
    report.max_depth = params.max_depth;
    report.paths = params.slot_count;
    report.seed = params.seed;
    report.policy = policy_name(options_.policy);
    report.connection = options_.connection == Connection::queue ? "queue" : "roulette";
    report.film_hash = film->hash();
    report.clamped_samples = film->clamped();
    report.checkpoint = {done.runs, checkpointer_->written(), checkpointer_->seconds(), checkpointer_->advice()};
    report.seconds.total = seconds_since(start_);
    report.seconds.render = done.render_seconds;
    for (size_t i = 0; i < report.seconds.stages.size(); i++) {
        report.seconds.stages[i] = done.stage_seconds[i];
        report.seconds.trace += done.stage_seconds[i];
    }
    report.seconds.stall = done.stall_seconds;
    report.seconds.build = device_->build_seconds();
    report.rays = {done.camera_rays, done.bounce_rays, done.shadow_rays};
    report.paging = {done.loads, done.evictions, done.bytes_loaded, done.rounds, done.wants_without_hit};
    // Every sample that was begun has ended up in the film.
    if (!stopped_ && !report.complete)
        return Status::failed(fmt::format("the film holds {} samples, but {} were begun; this is a bug", film->samples(), params.sample_limit));
    return result;
}

}  // namespace

Result<RenderResult> render(const BlockFile& scene, const RenderOptions& options, const RenderCallbacks& callbacks) {
    return Renderer(scene, options, callbacks).run();
}

}  // namespace raypager
