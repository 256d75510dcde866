#include "render/job.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "base/log.hpp"
#include "base/words.hpp"
#include "render/params.hpp"
#include "wavefront/sample_order.hpp"

namespace raypager {

Status RenderJob::prepare() {
    RAYPAGER_TRY(check_instruments(options_, instruments_));
    auto params = make_params(scene_, options_);
    if (!params) return params.status();
    pixels_ = uint64_t{params->width} * params->height;
    full_width_ = params->width;
    full_height_ = params->height;
    auto device = Device::open(options_.device, options_.memory_limit, options_.tuning.profile, instruments_.device_hooks);
    if (!device) return device.status();
    const DeviceInfo& info = (*device)->info();
    RAYPAGER_TRY(check_picture_size(*params, info));
    // It takes some milliseconds, which short renders would notice.
    const RenderIdentity identity = options_.checkpoint.file.empty() ? RenderIdentity() : identity_of(scene_, *params);
    auto checkpointer = Checkpointer::create(options_.checkpoint, identity, params->spp, params->order, info.name + ", " + info.driver);
    if (!checkpointer) return checkpointer.status();
    checkpointer_ = std::move(*checkpointer);
    if (checkpointer_->other_device()) warn("the checkpoint was written on another device or driver: the last bits of the picture may differ");
    params->first_sample = checkpointer_->first_sample();
    params->order = checkpointer_->order();
    earlier_ = checkpointer_->earlier_work();
    if (goes_coarse_first(*params)) params->first_sample = pixels_;

    const auto to_user = [this](const std::string& text) { warn(text); };
    auto rounds = DeviceRounds::create(source_, options_, instruments_, *params, std::move(*device), to_user);
    if (!rounds) return rounds.status();
    rounds_ = std::move(*rounds);
    RAYPAGER_TRY(checkpointer_->restore(wavefront()));
    if (params->adaptive_error > 0) RAYPAGER_TRY(begin_adaptive(checkpointer_->resumed()));
    if (goes_coarse_first(*params)) RAYPAGER_TRY(begin_first_pass());
    RAYPAGER_TRY(begin_parts());
    watch();
    recorder_.begin(options_.tuning, instruments_, wavefront().params(), rounds_->device().info().cpu_cores());
    render_start_ = Clock::now();
    next_snapshot_ = snapshot_interval_ = options_.snapshot_seconds;
    if (options_.tuning.pool_place == PoolPlace::host) RAYPAGER_TRY(rounds_->residency().load_all(rounds_->device().kernels()));
    if (callbacks_.begins) callbacks_.begins();
    return {};
}

Status RenderJob::step() {
    const auto round = [this]() -> Status {
        while (rounds_->may_start()) RAYPAGER_TRY(rounds_->start());
        RAYPAGER_TRY(finish_round());
        RAYPAGER_TRY(rounds_->page());
        watchdog_->round_ended(make_round_state(rounds_->ended(), rounds_->counters(), rounds_->residency()));
        if ((rounds_->nothing_to_trace() || options_.tuning.wait_for_loads) && rounds_->under_way() == 0) RAYPAGER_TRY(wait_for_block());
        RAYPAGER_TRY(end_early());
        if (adaptive_) RAYPAGER_TRY(end_stage());
        RAYPAGER_TRY(go_on_with_first_pass());
        RAYPAGER_TRY(go_on_with_parts());
        if (checkpointer_->due()) RAYPAGER_TRY(keep_checkpoint());
        return report_progress();
    };
    const Status status = round();
    return status ? status : with_advice(status);
}

Result<MeasuredRender> RenderJob::finish() {
    Status status = settle();
    if (status && checkpointer_->enabled()) status = keep_checkpoint();
    if (!status) return with_advice(status);
    auto finished = result();
    return finished ? std::move(finished) : with_advice(finished.status());
}

Status RenderJob::finish_round() {
    watchdog_->doing("tracing");
    RAYPAGER_TRY(rounds_->finish());
    part_begins_ = false;
    return recorder_.round_ended(wavefront(), render_seconds() - snapshot_seconds_);
}

// Ends all rounds under way, so that the counters are those of the state on the device.
Status RenderJob::settle() {
    while (rounds_->under_way() > 0) RAYPAGER_TRY(finish_round());
    return {};
}

Status RenderJob::wait_for_block() {
    watchdog_->doing("waiting for a block");
    return rounds_->wait_for_block();
}

// When time is up, or a stop is asked for, few camera paths begin any more (wavefront/sample_order.hpp), and all paths finish; but after a stop they
// do not get long for it, and with a checkpoint, which keeps them, no time at all.
Status RenderJob::end_early() {
    const auto is_set = [](const std::atomic<bool>* flag) { return flag != nullptr && flag->load(); };
    if (rounds_->all_idle()) return {};
    const double now = render_seconds();
    const bool at_once = cancelled_ || is_set(options_.stop_now), stop = at_once || is_set(options_.stop), first = stop && !stop_began_;
    if (first) stop_began_ = now;
    stopped_ = stop && (checkpointer_->enabled() || at_once || now - *stop_began_ >= options_.stop_seconds);
    const bool late = !late_ && options_.time_seconds > 0 && now >= options_.time_seconds;
    late_ = late_ || late;
    return !stopped_ && (first || late) ? begin_fewer(stop) : Status();
}

Status RenderJob::begin_fewer(bool stop) {
    RAYPAGER_TRY(settle());
    RAYPAGER_TRY(end_first_pass());
    const rp_render_params& params = wavefront().params();
    const uint64_t begun = rounds_->counters().next_sample(), before = params.sample_limit;
    const bool in_stage = adaptive_ && begun >= params.stage_begin;
    uint64_t limit = in_stage ? begun : early_limit(params.order, begun, before, pixels_, !stop);
    shortened_ = shortened_ || (stop && limit < before);
    // Where there is no time for the whole first pass, the rest of the picture becomes a coarse one.
    const double each = begun > 0 ? render_seconds() / static_cast<double>(begun) : 1e-6;
    const bool takes_long = begun<limit&& static_cast<double>(limit - begun) * each> options_.stop_seconds / 2;
    if (stop && takes_long && !wavefront().begins_again()) {
        constexpr double most = 1 << 22;
        const double in_time = std::clamp(options_.stop_seconds / each, 4096.0, most);
        auto samples = coarse_samples(params.order, begun, params.width, params.height, static_cast<uint64_t>(in_time));
        limit = begun;
        coarse_ = samples.size();
        wavefront().begin_with(std::move(samples));
    }
    return wavefront().set_sample_limit(limit);
}

// A checkpoint that cannot be written is no reason to end: the disk may have room again the next time.
Status RenderJob::keep_checkpoint() {
    if (between_stages_) return {};
    RAYPAGER_TRY(settle());
    watchdog_->doing("writing the checkpoint");
    const Status status = checkpointer_->write(wavefront(), samples_begun(), work());
    if (!status) warn(status.message() + "; the checkpoint before it stays, and the render goes on");
    return {};
}

void RenderJob::warn(const std::string& message) const {
    if (callbacks_.warning)
        callbacks_.warning(message);
    else
        log_warning(message);
}

// An error that ends a render does not end its checkpoint.
Status RenderJob::with_advice(const Status& error) const {
    const std::string advice = checkpointer_->advice();
    return advice.empty() ? error : Status::failed(error.message() + "; " + advice);
}

WorkDone RenderJob::work() const {
    WorkDone sum = earlier_;
    sum.render_seconds += render_seconds();
    sum.stall_seconds += rounds_->stall_seconds();
    for (size_t i = 0; i < std::size(sum.stage_seconds); i++) sum.stage_seconds[i] += static_cast<double>(wavefront().stage_nanoseconds()[i]) * 1e-9;
    sum.camera_rays += rounds_->counters().camera_rays();
    sum.bounce_rays += rounds_->counters().bounce_rays();
    sum.shadow_rays += rounds_->counters().total_shadow_rays();
    const PagingStatistics& paging = rounds_->residency().statistics();
    sum.loads += paging.loads;
    sum.evictions += paging.evictions;
    sum.bytes_loaded += paging.bytes_loaded;
    sum.rounds += rounds_->ended();
    sum.requests_without_hit += rounds_->counters().requests_without_hit();
    sum.runs++;
    sum.stall_seconds -= outside_.stall_seconds;
    sum.loads -= outside_.loads;
    sum.evictions -= outside_.evictions;
    sum.bytes_loaded -= outside_.bytes_loaded;
    sum.rounds -= outside_.rounds;
    return sum;
}

RenderProgress RenderJob::progress() const {
    const WorkDone done = work();
    RenderProgress p;
    p.seconds = done.render_seconds;
    p.snapshot_seconds = snapshot_seconds_;
    const uint64_t begun = samples_begun() + coarse_ - first_pass_.left() - wavefront().again_left();
    p.spp = static_cast<double>(begun) / static_cast<double>(pixels_);
    const uint64_t under_way = uint64_t{rounds_->ready_rays()} + rounds_->counters().waiting_rays();
    p.finished_spp = static_cast<double>(begun - std::min(begun, under_way)) / static_cast<double>(pixels_);
    const uint64_t most = adaptive_ ? pixels_ * wavefront().params().spp : samples_to_begin();
    const double by_samples = last_stage_ended_ ? 1 : static_cast<double>(begun) / static_cast<double>(most);
    const double by_time = options_.time_seconds > 0 ? p.seconds / (earlier_.render_seconds + options_.time_seconds) : 0;
    p.fraction = std::min(1.0, std::max(by_samples, by_time));
    p.rays = done.camera_rays + done.bounce_rays + done.shadow_rays;
    p.rays_per_second = rate_;
    p.loads = done.loads;
    p.bytes_loaded = done.bytes_loaded;
    p.resident_bytes = rounds_->residency().resident_bytes();
    p.geometry_bytes = scene_.memory_bytes(rounds_->plan().form);
    p.pool_bytes = rounds_->residency().pool_bytes();
    return p;
}

Status RenderJob::for_film_pieces(const std::function<Status(uint64_t first_word, std::span<uint32_t> words)>& see) {
    const uint64_t all = wavefront().film_words(), most = film_piece_words(FilmLayout(wavefront().params()).words());
    std::vector<uint32_t> words(std::min(most, all));
    for (uint64_t first = 0; first < all; first += most) {
        const std::span<uint32_t> piece = std::span(words).first(std::min(most, all - first));
        RAYPAGER_TRY(wavefront().read_film(first, piece));
        RAYPAGER_TRY(see(first, piece));
    }
    return {};
}

Result<FilmResolver> RenderJob::read_film(FilmUse use) {
    const rp_render_params& params = wavefront().params();
    FilmResolver film(params.width, params.height, scene_.film, params.background_kind == RP_BACKGROUND_TRANSPARENT, FilmLayout(params), use);
    RAYPAGER_TRY(for_film_pieces([&](uint64_t, std::span<uint32_t> words) -> Status {
        film.add(words);
        return {};
    }));
    return film;
}

Status RenderJob::report_progress() {
    const double now = render_seconds();
    if (callbacks_.progress && now >= next_progress_) {
        next_progress_ = now + options_.progress_seconds;
        const uint64_t rays = rounds_->counters().camera_rays() + rounds_->counters().bounce_rays() + rounds_->counters().total_shadow_rays();
        if (now > last_reported_) rate_ = static_cast<double>(rays - last_rays_) / (now - last_reported_);
        last_reported_ = now;
        last_rays_ = rays;
        callbacks_.progress(progress());
    }
    return callbacks_.snapshot && options_.snapshot_seconds > 0 && now >= next_snapshot_ ? snapshot(now) : Status();
}

Status RenderJob::snapshot(double now) {
    watchdog_->doing("writing a snapshot");
    RenderProgress p = progress();
    auto film = read_film();
    if (!film) return film.status();
    p.spp = static_cast<double>(film->samples()) / static_cast<double>(pixels_);
    Image image = film->take_image();
    std::vector<FilmLayerImage> layers = film->take_layers();
    RAYPAGER_TRY(callbacks_.snapshot(image, layers, p));
    const double end = render_seconds();
    snapshot_seconds_ += end - now;
    snapshot_interval_ *= options_.snapshot_growth;
    next_snapshot_ = end + snapshot_interval_;
    return {};
}

Result<Image> RenderJob::picture(double* spp) {
    RAYPAGER_TRY(settle());
    auto film = read_film(FilmUse::picture);
    if (!film) return film.status();
    if (spp) *spp = static_cast<double>(film->samples()) / static_cast<double>(pixels_);
    return film->take_image();
}

Status RenderJob::write_checkpoint() {
    if (!checkpointer_->enabled()) return Status::usage("there is no checkpoint file; name one in the options");
    if (between_stages_) return Status::failed("the render failed between two stages; the checkpoint before it stays");
    RAYPAGER_TRY(settle());
    return checkpointer_->write(wavefront(), samples_begun(), work());
}

Result<MeasuredRender> RenderJob::result() {
    auto film = read_film();
    if (!film) return film.status();
    MeasuredRender result;
    result.image = film->take_image();
    result.report = make_report(*film);
    result.layers = film->take_layers();
    // Every sample that was begun has ended up in the film.
    if (!stopped_ && film->samples() != samples_to_begin() && (rounds_->all_idle() || last_stage_ended_))
        return Status::failed(fmt::format("the film holds {} samples, but {} were begun; this is a bug", film->samples(), samples_to_begin()));
    recorder_.finish(scene_, rounds_->residency(), wavefront().params(), result);
    return result;
}

RenderReport RenderJob::make_report(const FilmResolver& film) const {
    const rp_render_params& params = wavefront().params();
    const WorkDone done = work();
    RenderReport report;
    const DeviceInfo& info = rounds_->device().info();
    report.device = {info.name, info.platform, info.driver, std::string(device_type_name(info.type))};
    report.limits = {rounds_->device().budget().limit(), rounds_->residency().pool_bytes(), rounds_->plan().host_limit};
    report.peak = {rounds_->device().budget().peak(), rounds_->residency().statistics().peak_resident_bytes, rounds_->residency().host_peak_bytes()};
    report.width = params.width;
    report.height = params.height;
    // A stop may find nothing left to do but the rounds under way, which have ended since.
    report.complete = !shortened_ && film.samples() == samples_to_begin();
    report.unsampled = film.unsampled();
    report.average_spp = static_cast<double>(film.samples()) / static_cast<double>(pixels_);
    report.spp = static_cast<uint32_t>(film.samples() / pixels_);
    report.max_depth = params.max_depth;
    report.paths = params.slot_count;
    report.seed = params.seed;
    report.tile_size = params.order.tile_size;
    report.together = params.order.together;
    report.region = params.order.region;
    report.policy = policy_name(options_.tuning.policy);
    report.connection = options_.connection == Connection::queue ? "queue" : "roulette";
    report.form = rounds_->plan().form;
    report.film_hash = film.hash();
    report.layers = options_.layers;
    report.layers_hash = film.layers_hash();
    report.clamped_samples = film.clamped();
    report.checkpoint = {done.runs, checkpointer_->written(), checkpointer_->seconds(), checkpointer_->advice()};
    report.seconds.total = std::chrono::duration<double>(Clock::now() - start_).count();
    report.seconds.render = done.render_seconds;
    std::copy_n(done.stage_seconds, report.seconds.stages.size(), report.seconds.stages.begin());
    for (const double seconds : done.stage_seconds) report.seconds.trace += seconds;
    report.seconds.trace -= static_cast<double>(wavefront().concurrent_nanoseconds()) * 1e-9;
    report.seconds.stall = done.stall_seconds;
    report.seconds.snapshots = snapshot_seconds_;
    report.seconds.build = rounds_->device().build_seconds();
    report.rays = {done.camera_rays, done.bounce_rays, done.shadow_rays};
    report.paging = {done.loads, done.evictions, done.bytes_loaded, done.rounds, done.requests_without_hit, rounds_->texture_waits()};
    return report;
}

}  // namespace raypager
