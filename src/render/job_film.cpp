// The film of a render, which is the sum of those of its devices, and what becomes of it: snapshots, the picture, the report.
#include <fmt/format.h>

#include <algorithm>

#include "base/parallel.hpp"
#include "render/job.hpp"
#include "render/params.hpp"

namespace raypager {

// One device that has all of it keeps it. What others have comes into host memory before it is read.
Status RenderJob::read_words(uint64_t first_word, std::span<uint32_t> words) {
    if (!keeps_film()) return wavefront().read_film(first_word, words);
    const auto kept = std::span<const uint32_t>(film_).subspan(first_word, words.size());
    std::copy(kept.begin(), kept.end(), words.begin());
    return {};
}

Status RenderJob::write_words(uint64_t first_word, std::span<const uint32_t> words) {
    if (!keeps_film()) return wavefront().write_film(first_word, words);
    std::copy(words.begin(), words.end(), film_.begin() + static_cast<std::ptrdiff_t>(first_word));
    return {};
}

Status RenderJob::begin_kept_film() {
    if (!keeps_film()) return {};
    if (has_windows()) RAYPAGER_TRY(check_host_film(wavefront().params()));
    film_.assign(film_words(), 0);
    device_film_.resize(wavefront().film_words());
    return {};
}

// The part of the film that devices have now.
std::span<uint32_t> RenderJob::film_of_devices() {
    const rp_render_params& params = wavefront().params();
    const uint64_t first = uint64_t{params.width} * params.film_first_row * FilmLayout(params).words();
    return std::span(film_).subspan(first, std::min<uint64_t>(device_film_.size(), film_.size() - first));
}

// Then it is safe, whichever of several devices fails afterwards. REQUIRES: settled.
Status RenderJob::collect_films() {
    if (!keeps_film()) return {};
    return on_each_device([this](DeviceWorker& worker) { return collect_film(worker); });
}

// All of the device's film is here before any of it is added.
Status RenderJob::collect_film(DeviceWorker& worker) {
    if (!worker.has_new_film()) return {};
    Wavefront& w = worker.wavefront();
    const FilmLayout layout(w.params());
    const uint64_t piece_words = film_piece_words(layout.words());
    const std::span<uint32_t> kept = film_of_devices(), taken = std::span(device_film_).first(kept.size());
    const auto piece_at = [piece_words](std::span<uint32_t> film, uint64_t first) {
        return film.subspan(first, std::min(piece_words, film.size() - first));
    };
    for (uint64_t first = 0; first < taken.size(); first += piece_words) RAYPAGER_TRY(w.read_film(first, piece_at(taken, first)));
    std::vector<rp_path_sample> under_way;
    RAYPAGER_TRY(worker.rounds().read_samples_under_way(under_way));
    RAYPAGER_TRY(w.clear_film());
    const FilmAdder adder(layout);
    parallel_for((kept.size() + piece_words - 1) / piece_words, 1,
                 [&](size_t piece, size_t) { adder.add(piece_at(kept, piece * piece_words), piece_at(taken, piece * piece_words)); });
    worker.film_was_taken(std::move(under_way));
    return {};
}

Status RenderJob::for_film_pieces(const std::function<Status(uint64_t first_word, std::span<uint32_t> words)>& see) {
    RAYPAGER_TRY(collect_films());
    const uint64_t all = film_words(), most = film_piece_words(FilmLayout(wavefront().params()).words());
    std::vector<uint32_t> words(std::min(most, all));
    for (uint64_t first = 0; first < all; first += most) {
        const std::span<uint32_t> piece = std::span(words).first(std::min(most, all - first));
        RAYPAGER_TRY(read_words(first, piece));
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

Status RenderJob::snapshot(double now) {
    if (keeps_film()) RAYPAGER_TRY(settle());
    devices_.doing("writing a snapshot");
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

Status RenderJob::check_alone() const {
    return options_.peers ? Status::usage("the picture of a render that several processes share is there at its end, and in snapshots") : Status();
}

Result<Image> RenderJob::picture(double* spp) {
    RAYPAGER_TRY(check_alone());
    RAYPAGER_TRY(settle());
    auto film = read_film(FilmUse::picture);
    if (!film) return film.status();
    if (spp) *spp = static_cast<double>(film->samples()) / static_cast<double>(pixels_);
    return film->take_image();
}

Result<std::vector<FilmLayerImage>> RenderJob::layers_at(uint32_t x, uint32_t y) {
    RAYPAGER_TRY(check_alone());
    RAYPAGER_TRY(settle());
    RAYPAGER_TRY(collect_films());
    const FilmLayout layout(wavefront().params());
    std::vector<uint32_t> words(layout.words());
    RAYPAGER_TRY(read_words((uint64_t{y} * wavefront().params().width + x) * layout.words(), words));
    LayerResolver layers(1, 1, layout);
    layers.add(words, words[RP_FILM_COUNT] & RP_FILM_COUNT_MASK);
    return layers.take();
}

Result<MeasuredRender> RenderJob::result() {
    auto film = read_film();
    if (!film) return film.status();
    MeasuredRender result;
    result.image = film->take_image();
    result.report = make_report(*film);
    result.layers = film->take_layers();
    // Every sample that was begun has ended up in the film.
    if (options_.peers && options_.peers->rank() > 0) return result;
    if (!stopped_ && film->samples() != samples_to_begin_ && (all_ended() || last_stage_ended_))
        return Status::failed(fmt::format("the film holds {} samples, but {} were begun; this is a bug", film->samples(), samples_to_begin_));
    recorder_.finish(scene_, first().rounds().residency(), wavefront().params(), result);
    return result;
}

RenderReport::DeviceWork RenderJob::device_work(const DeviceWorker& worker) {
    const DeviceRounds& rounds = worker.rounds();
    const WorkerFigures figures = worker.figures();
    const DeviceInfo& info = rounds.device().info();
    RenderReport::DeviceWork work;
    work.facts = {info.name, info.platform, info.driver, std::string(device_type_name(info.type))};
    work.index = info.index;
    work.samples = figures.work.camera_rays;
    work.rays = figures.work.camera_rays + figures.work.bounce_rays + figures.work.shadow_rays;
    work.loads = figures.paging.loads;
    work.evictions = figures.paging.evictions;
    work.bytes_loaded = figures.paging.bytes_loaded;
    work.rounds = figures.rounds;
    work.texture_waits = figures.texture_waits;
    work.peak_memory_bytes = rounds.device().budget().peak();
    work.peak_geometry_bytes = figures.paging.peak_resident_bytes;
    for (const double seconds : figures.work.stage_seconds) work.trace_seconds += seconds;
    work.trace_seconds -= static_cast<double>(worker.wavefront().concurrent_nanoseconds()) * 1e-9;
    work.stall_seconds = figures.work.stall_seconds;
    work.build_seconds = rounds.device().build_seconds();
    return work;
}

uint64_t RenderJob::peak_host_bytes() const { return first().rounds().residency().host_peak_bytes() + blocks_from().held_bytes(); }

RenderReport RenderJob::make_report(const FilmResolver& film) const {
    const rp_render_params& params = wavefront().params();
    WorkDone done = work();
    done += of_peers_;
    RenderReport report;
    const DeviceRounds& rounds = first().rounds();
    report.limits = {rounds.device().budget().limit(), rounds.residency().pool_bytes(), rounds.plan().host_limit};
    report.peak.host_bytes = peak_host_bytes();
    for (const RenderReport::Rank& rank : rank_figures_) report.peak.host_bytes = std::max(report.peak.host_bytes, rank.peak_host_bytes);
    for (size_t i = 0; i < devices_.count(); i++) report.devices.push_back(device_work(devices_.worker(i)));
    report.devices.insert(report.devices.end(), peer_devices_.begin(), peer_devices_.end());
    for (const RenderReport::DeviceWork& device : report.devices) {
        report.peak.memory_bytes = std::max(report.peak.memory_bytes, device.peak_memory_bytes);
        report.peak.geometry_bytes = std::max(report.peak.geometry_bytes, device.peak_geometry_bytes);
        report.seconds.build = std::max(report.seconds.build, device.build_seconds);
        report.paging.texture_waits += device.texture_waits;
    }
    report.paging.texture_waits += texture_waits_before_;
    report.ranks = rank_figures_;
    report.device = report.devices.front().facts;
    report.width = params.width;
    report.height = params.height;
    // A stop may find nothing left to do but the rounds under way, which have ended since.
    report.complete = !shortened_ && film.samples() == samples_to_begin_;
    report.unsampled = film.unsampled();
    report.average_spp = static_cast<double>(film.samples()) / static_cast<double>(pixels_);
    report.spp = static_cast<uint32_t>(film.samples() / pixels_);
    report.max_depth = params.max_depth;
    report.paths = params.slot_count;
    report.seed = params.seed;
    report.tile_size = params.order.tile_size;
    report.together = params.order.together;
    report.region = params.order.region;
    report.film_rows = params.film_rows;
    report.policy = policy_name(options_.tuning.policy);
    report.connection = options_.connection == Connection::queue ? "queue" : "roulette";
    report.form = rounds.plan().form;
    report.film_hash = film.hash();
    report.layers = options_.layers;
    report.layers_hash = film.layers_hash();
    report.clamped_samples = film.clamped();
    report.checkpoint = {done.runs, checkpointer_->written(), checkpointer_->seconds(), checkpointer_->advice()};
    report.seconds.total = std::chrono::duration<double>(Clock::now() - start_).count();
    report.seconds.render = done.render_seconds;
    std::copy_n(done.stage_seconds, report.seconds.stages.size(), report.seconds.stages.begin());
    for (const double seconds : done.stage_seconds) report.seconds.trace += seconds;
    report.seconds.trace -= concurrent_of_peers_;
    for (size_t i = 0; i < devices_.count(); i++)
        report.seconds.trace -= static_cast<double>(devices_.worker(i).wavefront().concurrent_nanoseconds()) * 1e-9;
    report.seconds.stall = done.stall_seconds;
    report.seconds.snapshots = snapshot_seconds_;
    report.rays = {done.camera_rays, done.bounce_rays, done.shadow_rays};
    report.paging.loads = done.loads;
    report.paging.evictions = done.evictions;
    report.paging.bytes_loaded = done.bytes_loaded;
    report.paging.rounds = done.rounds;
    report.paging.requests_without_hit = done.requests_without_hit;
    return report;
}

}  // namespace raypager
