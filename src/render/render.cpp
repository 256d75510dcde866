#include "render/render.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "base/check.hpp"
#include "base/log.hpp"
#include "base/words.hpp"
#include "device/device.hpp"
#include "film/film.hpp"
#include "render/checkpointer.hpp"
#include "render/recorder.hpp"
#include "render/setup.hpp"
#include "render/watchdog.hpp"
#include "residency/residency.hpp"
#include "wavefront/sample_order.hpp"
#include "wavefront/wavefront.hpp"

namespace raypager {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point begin) { return std::chrono::duration<double>(Clock::now() - begin).count(); }

// One render from start to end. run() is the loop; everything else serves it.
class Renderer {
public:
    Renderer(const BlockSource& source, const RenderOptions& options, const RenderCallbacks& callbacks)
        : source_(source), scene_(source.scene()), options_(options), callbacks_(callbacks) {}

    Result<RenderResult> run() {
        RAYPAGER_TRY(prepare());
        if (Status status = render_rounds(); !status.ok()) return with_advice(status);
        auto finished = result();
        if (!finished) return with_advice(finished.status());
        return finished;
    }

private:
    Status render_rounds() {
        if (callbacks_.begins) callbacks_.begins();
        while (!finished() && !stopped_) {
            while (rounds_under_way() < rounds_wanted()) RAYPAGER_TRY(start_round());
            RAYPAGER_TRY(finish_round());
            RAYPAGER_TRY(residency_->after_round(ended_, started_, wavefront_->last_round_end(), demand_, ready_rays(), slots()));
            watchdog_->round_ended(round_state());
            if ((nothing_to_trace() || options_.wait_for_loads) && rounds_under_way() == 0) RAYPAGER_TRY(wait_for_block());
            RAYPAGER_TRY(end_early());
            if (checkpointer_->due()) RAYPAGER_TRY(keep_checkpoint());
            RAYPAGER_TRY(tell());
        }
        RAYPAGER_TRY(settle());
        return checkpointer_->enabled() ? keep_checkpoint() : Status();
    }

    Status prepare();
    Status make_device_state(rp_render_params params, uint64_t memory_limit);
    void note_reduced_limit(const rp_render_params& params) const;
    Status create_residency(uint64_t pool_bytes);
    uint32_t slots() const { return wavefront_->params().slot_count; }
    uint32_t rounds_under_way() const { return started_ - ended_; }
    uint32_t rounds_wanted() const {
        if (nothing_to_trace() || wavefront_->begins_again() || options_.wait_for_loads || recorder_.visits()) return 1;
        return options_.rounds_under_way ? options_.rounds_under_way : std::min(device_->profile().rounds_under_way, Wavefront::most_rounds);
    }
    Status start_round();
    Status finish_round();
    void fill_by_waits();
    Status settle();
    uint32_t ready_rays() const { return counters_.extend_rays() + counters_.shadow_rays(); }
    uint64_t samples_begun() const { return counters_.next_sample(); }
    uint64_t samples_to_begin() const { return wavefront_->params().sample_limit + coarse_; }
    bool finished() const { return counters_.idle_slots() == slots(); }
    // Rays there are, but all wait for blocks; or none, and then the next round starts new paths or ends the render.
    bool nothing_to_trace() const { return ready_rays() == 0 && counters_.waiting_rays() > 0; }
    Status wait_for_block();
    Status end_early();
    Status begin_fewer(bool stop);
    Status keep_checkpoint();
    Status tell();
    Status snapshot(double now);
    void warn(const std::string& message) const;
    Status with_advice(const Status& error) const;
    WorkDone work() const;
    RoundState round_state() const { return make_round_state(ended_, counters_, *residency_); }
    RenderProgress progress() const;
    Result<FilmResolver> read_film();
    Result<RenderResult> result();

    const BlockSource& source_;
    const BakedScene& scene_;
    const RenderOptions& options_;
    const RenderCallbacks& callbacks_;
    std::unique_ptr<Device> device_;
    std::unique_ptr<Residency> residency_;
    std::unique_ptr<Wavefront> wavefront_;
    std::optional<Checkpointer> checkpointer_;
    std::unique_ptr<Watchdog> watchdog_;  // asks residency_: destroyed before it
    RoundCounters counters_;
    bool fills_by_waits_ = false;
    std::span<const uint32_t> demand_;
    WorkDone earlier_;  // by runs before this one
    uint64_t pixels_ = 0, host_limit_ = 0, planned_bytes_ = 0;
    BlockForm form_ = BlockForm::stored;
    uint32_t started_ = 0, ended_ = 0;  // rounds, numbered from 1
    bool late_ = false;                 // time is up: few samples begin any more
    std::optional<double> stop_began_;  // the same, because of a stop from outside
    bool shortened_ = false;            // by a stop, which takes samples from the picture
    bool stopped_ = false;              // here and now
    uint64_t coarse_ = 0;               // samples that are begun in an order of their own then
    double stall_seconds_ = 0, snapshot_seconds_ = 0, snapshot_interval_ = 0;
    RenderRecorder recorder_;
    Clock::time_point start_ = Clock::now(), render_start_ = start_;
    double next_progress_ = 0, next_snapshot_ = 0, last_told_ = 0;
    uint64_t last_rays_ = 0;
    mutable double rate_ = 0;
};

Status Renderer::prepare() {
    auto params = make_params(scene_, options_);
    if (!params) return params.status();
    pixels_ = uint64_t{params->width} * params->height;
    auto device = Device::open(options_.device, options_.memory_limit, options_.tuning, options_.device_hooks);
    if (!device) return device.status();
    device_ = std::move(*device);
    RAYPAGER_TRY(check_picture_size(*params, device_->info()));
    // It takes some milliseconds, which short renders would notice.
    const RenderIdentity identity = options_.checkpoint.file.empty() ? RenderIdentity() : identity_of(scene_, *params);
    auto checkpointer =
        Checkpointer::create(options_.checkpoint, identity, params->spp, params->order, device_->info().name + ", " + device_->info().driver);
    if (!checkpointer) return checkpointer.status();
    checkpointer_ = std::move(*checkpointer);
    if (checkpointer_->other_device()) warn("the checkpoint was written on another device or driver: the last bits of the picture may differ");
    params->first_sample = checkpointer_->first_sample();
    params->order = checkpointer_->order();
    earlier_ = checkpointer_->earlier_work();

    const uint64_t allowed = device_->budget().limit();
    Status made = make_device_state(*params, allowed);
    // Another process may hold memory that the driver counts as ours: then with less, until the least that would do is refused, too.
    uint64_t refused = 0;
    while (!made && device_ && device_->refused_memory()) {
        refused = planned_bytes_;
        const uint64_t less = refused / 8 * 7;
        warn(fmt::format("{}; trying with {} of device memory", made.message(), format_bytes(less)));
        made = make_device_state(*params, less);
    }
    if (!made && refused > 0) return Status::failed(fmt::format("the device refused {}; with less, {}", format_bytes(refused), made.message()));
    RAYPAGER_TRY(made);
    note_reduced_limit(*params);
    RAYPAGER_TRY(checkpointer_->restore(*wavefront_));
    const auto told = [this](const std::string& text) { warn(text); };
    watchdog_ = std::make_unique<Watchdog>(
        options_.stall_seconds, [this] { return residency_->loader_activity(); }, told);
    recorder_.begin(options_, wavefront_->params(), device_->info().cpu_cores());
    render_start_ = Clock::now();
    next_snapshot_ = snapshot_interval_ = options_.snapshot_seconds;
    return options_.pool_place == PoolPlace::host ? residency_->load_all(device_->kernels()) : Status();
}

// The device with everything on it, within a limit.
Status Renderer::make_device_state(rp_render_params params, uint64_t memory_limit) {
    wavefront_.reset();
    residency_.reset();
    if (device_->budget().limit() != memory_limit) {
        device_.reset();
        auto device = Device::open(options_.device, memory_limit, options_.tuning, options_.device_hooks);
        if (!device) return device.status();
        device_ = std::move(*device);
    }
    const VisitLogSettings visits = visit_log_settings(scene_, options_, params, device_->info());
    RAYPAGER_TRY(check_traversal(options_.traversal, device_->info()));
    form_ = block_form(options_, device_->info());
    const MemoryNeeds needs = memory_needs(scene_, form_, options_, params, visits, device_->info(), device_->budget().limit());
    auto plan = plan_memory(needs);
    if (!plan) return plan.status();
    params.slot_count = static_cast<uint32_t>(plan->slots);
    if (chooses_region(options_)) params.order.region = chosen_region(params.order, *plan, needs, pixels_);
    planned_bytes_ = needs.fixed + plan->slots * needs.per_slot + plan->pool_bytes;
    RAYPAGER_TRY(create_residency(plan->pool_bytes));
    const uint32_t slots_together = filled_together(params.order, *plan, needs);
    fills_by_waits_ = slots_together > 1 && !holds_all(*plan, needs);
    auto wavefront = Wavefront::create(*device_, scene_, form_, params, residency_->slabs(), residency_->page_table(), slots_together,
                                       holds_all(*plan, needs) ? BlockNotes() : block_notes(options_.policy), visits);
    if (!wavefront) return wavefront.status();
    wavefront_ = std::move(*wavefront);
    return {};
}

// The default limit is the same every time, unless less memory is free; who compares two renders should know, if that made a difference.
void Renderer::note_reduced_limit(const rp_render_params& params) const {
    const DefaultLimit& limit = device_->default_limit();
    if (options_.memory_limit || !limit.reduced()) return;
    const VisitLogSettings visits = visit_log_settings(scene_, options_, params, device_->info());
    const auto usual = plan_memory(memory_needs(scene_, form_, options_, params, visits, device_->info(), limit.usual));
    if (!usual || (usual->slots == slots() && usual->pool_bytes == residency_->pool_bytes())) return;
    warn(fmt::format("other programs hold much of the memory: the memory limit is {} instead of {}; --memory-limit sets another",
                     format_bytes(device_->budget().limit()), format_bytes(limit.usual)));
}

Status Renderer::create_residency(uint64_t pool_bytes) {
    const bool mapped = options_.pool_place == PoolPlace::host;
    ResidencySettings settings;
    settings.form = form_;
    settings.place = options_.pool_place;
    settings.pool_bytes = mapped ? whole_pool_bytes(scene_, form_, device_->info()) : pool_bytes;
    settings.slab_bytes = options_.slab_bytes;
    settings.journal = options_.keep_journal;
    host_limit_ = host_limit(options_, device_->info(), planned_bytes_);
    if (mapped && settings.pool_bytes > host_limit_)
        return Status::failed(fmt::format("--pool host: the geometry takes {} of host memory, the limit is {}; give a larger --host-limit",
                                          format_exact_bytes(settings.pool_bytes), format_bytes(host_limit_)));
    settings.host_limit = mapped ? host_limit_ - settings.pool_bytes : host_limit_;
    settings.loader_threads = options_.loader_threads;
    settings.read_ahead_threads = options_.read_ahead_threads;
    settings.policy = policy_settings(scene_, form_, options_, settings.pool_bytes, device_->info());
    auto residency = Residency::create(*device_, source_, settings);
    if (!residency) return residency.status();
    residency_ = std::move(*residency);
    return {};
}

Status Renderer::start_round() {
    if (++started_ == RP_NONE) return Status::failed("more rounds than blocks can count; give more --paths");
    RAYPAGER_TRY(residency_->publish(device_->kernels()));
    return wavefront_->start_round(started_, residency_->page_changes(), residency_->newly_published());
}

Status Renderer::finish_round() {
    watchdog_->doing("tracing");
    ended_++;
    RAYPAGER_TRY(wavefront_->finish_round(counters_, demand_));
    fill_by_waits();
    return recorder_.round_ended(*wavefront_, seconds_since(render_start_) - snapshot_seconds_);
}

// A ray that waits keeps the slots that were filled with it from being used. Extension rays stand for all.
void Renderer::fill_by_waits() {
    if (!fills_by_waits_) return;
    const uint64_t rays = counters_.camera_rays() + counters_.bounce_rays();
    if (rays < slots()) return;  // too few to tell
    wavefront_->fill_together(filled_together(static_cast<double>(counters_.wants_served()) / static_cast<double>(rays)));
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
    if (*arrived || !nothing_to_trace()) return {};
    return Status::failed(
        fmt::format("no progress in round {}: rays wait for blocks, but none is on its way: {}; this is a bug", ended_, describe(round_state())));
}

// When time is up, or a stop is asked for, few camera paths begin any more (wavefront/sample_order.hpp), and all paths finish; but after a stop they
// do not get long for it, and with a checkpoint, which keeps them, no time at all.
Status Renderer::end_early() {
    const auto is_set = [](const std::atomic<bool>* flag) { return flag != nullptr && flag->load(); };
    if (finished()) return {};
    const double now = seconds_since(render_start_);
    const bool stop = is_set(options_.stop) || is_set(options_.stop_now), first = stop && !stop_began_;
    if (first) stop_began_ = now;
    stopped_ = stop && (checkpointer_->enabled() || is_set(options_.stop_now) || now - *stop_began_ >= options_.stop_seconds);
    const bool late = !late_ && options_.time_seconds > 0 && now >= options_.time_seconds;
    late_ = late_ || late;
    return !stopped_ && (first || late) ? begin_fewer(stop) : Status();
}

Status Renderer::begin_fewer(bool stop) {
    RAYPAGER_TRY(settle());
    const rp_render_params& params = wavefront_->params();
    const uint64_t begun = counters_.next_sample(), before = params.sample_limit;
    uint64_t limit = early_limit(params.order, begun, before, pixels_, !stop);
    shortened_ = shortened_ || (stop && limit < before);
    // Where there is no time for the whole first pass, the rest of the picture becomes a coarse one.
    const double each = begun > 0 ? seconds_since(render_start_) / static_cast<double>(begun) : 1e-6;
    const bool takes_long = begun<limit&& static_cast<double>(limit - begun) * each> options_.stop_seconds / 2;
    if (stop && takes_long && !wavefront_->begins_again()) {
        constexpr double most = 1 << 22;
        const double in_time = std::clamp(options_.stop_seconds / each, 4096.0, most);
        auto samples = coarse_samples(params.order, begun, params.width, params.height, static_cast<uint64_t>(in_time));
        limit = begun;
        coarse_ = samples.size();
        wavefront_->begin_with(std::move(samples));
    }
    return wavefront_->set_sample_limit(limit);
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
    p.snapshot_seconds = snapshot_seconds_;
    p.spp = static_cast<double>(samples_begun()) / static_cast<double>(pixels_);
    const double by_samples = static_cast<double>(samples_begun()) / static_cast<double>(samples_to_begin());
    const double by_time = options_.time_seconds > 0 ? p.seconds / (earlier_.render_seconds + options_.time_seconds) : 0;
    p.fraction = std::min(1.0, std::max(by_samples, by_time));
    p.rays = done.camera_rays + done.bounce_rays + done.shadow_rays;
    p.rays_per_second = rate_;
    p.loads = done.loads;
    p.bytes_loaded = done.bytes_loaded;
    p.resident_bytes = residency_->resident_bytes();
    p.geometry_bytes = scene_.geometry_bytes(form_);
    return p;
}

Result<FilmResolver> Renderer::read_film() {
    const rp_render_params& params = wavefront_->params();
    FilmResolver film(params.width, params.height, scene_.film, params.background_kind == RP_BACKGROUND_TRANSPARENT);
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
    return callbacks_.snapshot && options_.snapshot_seconds > 0 && now >= next_snapshot_ ? snapshot(now) : Status();
}

Status Renderer::snapshot(double now) {
    watchdog_->doing("writing a snapshot");
    RenderProgress p = progress();
    auto film = read_film();
    if (!film) return film.status();
    p.spp = static_cast<double>(film->samples()) / static_cast<double>(pixels_);
    Image image = film->take_image();
    RAYPAGER_TRY(callbacks_.snapshot(image, p));
    const double end = seconds_since(render_start_);
    snapshot_seconds_ += end - now;
    snapshot_interval_ *= options_.snapshot_growth;
    next_snapshot_ = end + snapshot_interval_;
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
    report.device = {info.name, info.platform, info.driver, std::string(device_type_name(info.type))};
    report.limits = {device_->budget().limit(), residency_->pool_bytes(), host_limit_};
    report.peak = {device_->budget().peak(), residency_->statistics().peak_resident_bytes, residency_->host_peak_bytes()};
    report.width = params.width;
    report.height = params.height;
    // A stop may find nothing left to do but the rounds under way, which have ended since.
    const bool holds_all_begun = film->samples() == samples_to_begin();
    report.complete = !shortened_ && holds_all_begun;
    report.unsampled = film->unsampled();
    report.average_spp = static_cast<double>(film->samples()) / static_cast<double>(pixels_);
    report.spp = static_cast<uint32_t>(film->samples() / pixels_);
    report.max_depth = params.max_depth;
    report.paths = params.slot_count;
    report.seed = params.seed;
    report.tile_size = params.order.tile_size;
    report.together = params.order.together;
    report.region = params.order.region;
    report.policy = policy_name(options_.policy);
    report.connection = options_.connection == Connection::queue ? "queue" : "roulette";
    report.form = form_;
    report.film_hash = film->hash();
    report.clamped_samples = film->clamped();
    report.checkpoint = {done.runs, checkpointer_->written(), checkpointer_->seconds(), checkpointer_->advice()};
    report.seconds.total = seconds_since(start_);
    report.seconds.render = done.render_seconds;
    std::copy_n(done.stage_seconds, report.seconds.stages.size(), report.seconds.stages.begin());
    for (const double seconds : done.stage_seconds) report.seconds.trace += seconds;
    report.seconds.trace -= static_cast<double>(wavefront_->concurrent_nanoseconds()) * 1e-9;
    report.seconds.stall = done.stall_seconds;
    report.seconds.snapshots = snapshot_seconds_;
    report.seconds.build = device_->build_seconds();
    report.rays = {done.camera_rays, done.bounce_rays, done.shadow_rays};
    report.paging = {done.loads, done.evictions, done.bytes_loaded, done.rounds, done.wants_without_hit};
    // Every sample that was begun has ended up in the film.
    if (!stopped_ && !holds_all_begun)
        return Status::failed(fmt::format("the film holds {} samples, but {} were begun; this is a bug", film->samples(), samples_to_begin()));
    recorder_.finish(scene_, *residency_, wavefront_->params(), result);
    return result;
}

}  // namespace

Result<RenderResult> render(const BlockSource& scene, const RenderOptions& options, const RenderCallbacks& callbacks) {
    return Renderer(scene, options, callbacks).run();
}

}  // namespace raypager
