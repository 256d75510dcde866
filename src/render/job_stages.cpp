// What of a render comes in steps: the first pass that goes coarse to fine, the stages of adaptive sampling, and windows of the film.
#include <algorithm>

#include "render/job.hpp"
#include "wavefront/sample_order.hpp"

namespace raypager {

// Of a checkpoint every sample is known by its number or because its path is under way; a recording is one of the usual order.
bool RenderJob::goes_coarse_first(const rp_render_params& params) const {
    return options_.coarse_first && !keeps_film() && params.adaptive_error == 0 && !checkpointer_->enabled() && instruments_.record_paths == 0;
}

// Until all of them have begun, no samples are begun by number: those of the first pass count as begun already.
Status RenderJob::begin_first_pass() {
    const rp_render_params& params = wavefront().params();
    first_pass_ = FirstPass(params.order, params.width, params.height);
    begun_before_ = pixels_;
    in_first_pass_ = true;
    pool_.cut(0);
    wavefront().expect_more(true);
    wavefront().begin_with(first_pass_.take_step());
    return {};
}

Status RenderJob::go_on_with_first_pass() {
    if (!in_first_pass_ || stopped_ || wavefront().begins_again()) return {};
    if (!first_pass_.pending()) return end_first_pass();
    const DeviceRounds& rounds = first().rounds();
    if (!first_pass_.due(rounds.ready_rays() + rounds.counters().waiting_rays())) return {};
    RAYPAGER_TRY(settle());
    wavefront().begin_with(first_pass_.take_step());
    return {};
}

// What is left begins at once, beside those that follow by number.
Status RenderJob::end_first_pass() {
    if (!in_first_pass_) return {};
    RAYPAGER_TRY(settle());
    std::vector<rp_path_sample> rest = wavefront().samples_again_left();
    const std::vector<rp_path_sample> more = first_pass_.take_rest();
    rest.insert(rest.end(), more.begin(), more.end());
    wavefront().begin_with(std::move(rest));
    wavefront().expect_more(false);
    in_first_pass_ = false;
    pool_.add({{pixels_, sample_limit_}});
    return {};
}

bool RenderJob::stage_has_ended() const {
    if (devices_.several()) return devices_.idle();
    const WorkerFigures only = devices_.figures().front();
    return only.ready_rays == 0 && only.counters.waiting_rays() == 0 && !only.begins_again && pool_.left() == 0 &&
           only.begun == wavefront().numbers().count();
}

Status RenderJob::read_for_stage() {
    adaptive_->begin_taking();
    return for_film_pieces([this](uint64_t, std::span<uint32_t> words) -> Status {
        adaptive_->take(words);
        return {};
    });
}

// left: of its numbers, those that have not begun.
Status RenderJob::begin_stage(const SampleStage& stage, std::vector<SampleRange> left) {
    RAYPAGER_TRY(on_each_device(
        [&](DeviceWorker& worker) { return worker.wavefront().begin_stage(stage.begin, stage.first_sample, stage.passes, stage.pixels); }));
    sample_limit_ = samples_to_begin_ = stage.end();
    pool_.add(std::move(left));
    return {};
}

// next_sample: of a render that goes on, all numbers from it on have not begun.
Status RenderJob::begin_adaptive(std::optional<uint64_t> next_sample) {
    const rp_render_params& params = wavefront().params();
    const AdaptiveSettings settings = {params.adaptive_error, params.width, params.height, params.spp, params.order.tile_size};
    adaptive_.emplace(settings, FilmLayout(params));
    if (!next_sample) return {};
    RAYPAGER_TRY(options_.peers ? share_film_for_stage() : read_for_stage());
    const auto stage = adaptive_->resume(*next_sample);
    if (!stage) return stage.status().at(options_.checkpoint.file.string());
    if (stage->passes == 0) return {};
    const std::vector<SampleRange> gaps = pool_.ranges();
    if (!gaps.empty() && gaps.front().begin < stage->begin)
        return Status::failed("a sample of an earlier stage has not begun; the checkpoint is damaged, remove it to start over")
            .at(options_.checkpoint.file.string());
    // Several processes take them as numbers that they have in common.
    return begin_stage(*stage, options_.peers ? std::vector<SampleRange>() : std::vector{SampleRange{*next_sample, stage->end()}});
}

// Once the last path of a stage has ended, the film says which pixels go on.
Status RenderJob::end_stage() {
    if (stopped_ || !stage_has_ended()) return {};
    RAYPAGER_TRY(settle());
    RAYPAGER_TRY(collect_films());
    if (!stage_has_ended()) return {};  // a device has failed, and others do its work again
    last_stage_ended_ = late_ || stop_began_;
    shortened_ = shortened_ || stop_began_;  // of stages that do not come any more
    if (last_stage_ended_) return {};
    devices_.doing("choosing pixels");
    RAYPAGER_TRY(read_for_stage());
    const SampleStage& stage = adaptive_->next();
    if (stage.pixels.empty()) {
        last_stage_ended_ = true;
        return {};
    }
    const uint64_t words = FilmLayout(wavefront().params()).words();
    between_stages_ = true;
    RAYPAGER_TRY(for_film_pieces([&](uint64_t first, std::span<uint32_t> piece) {
        adaptive_->put(first / words, piece);
        return write_words(first, piece);
    }));
    RAYPAGER_TRY(begin_stage(stage, {{stage.begin, stage.end()}}));
    between_stages_ = false;
    return {};
}

Status RenderJob::begin_windows() {
    windows_ = FilmWindows(wavefront().params(), pool_.ranges(), pool_.again());
    pool_.clear();
    return windows_.any_left() ? begin_window() : Status();
}

// Once the last path in a window has ended, the device gets the next one.
Status RenderJob::go_on_with_windows() {
    if (stopped_ || !windows_.any_left() || !device_ended()) return {};
    RAYPAGER_TRY(settle());
    RAYPAGER_TRY(collect_films());
    return begin_window();
}

Status RenderJob::begin_window() {
    FilmWindows::Window window = windows_.take();
    pool_.add(std::move(window.ranges));
    pool_.add_again(window.again);
    return wavefront().move_film(window.first_row);
}

// Of ranges that have not begun, what still is to: what every pixel needs to have a sample, and, where it ends at a stop's or the clock's bidding
// between two passes, the rest of the pass that is under way. begun: the first of them follows samples that have begun.
std::vector<SampleRange> RenderJob::shorten(std::vector<SampleRange> ranges, bool begun, bool stop) {
    const rp_render_params& params = wavefront().params();
    std::vector<SampleRange> kept;
    for (SampleRange& range : ranges) {
        const bool goes_on = begun && &range == &ranges.front();
        const bool in_stage = adaptive_ && range.begin >= params.stage_begin;
        uint64_t end = range.begin;
        if (!in_stage && (goes_on || range.begin < pixels_)) end = early_limit(params.order, range.begin, range.end, pixels_, !stop);
        kept.push_back({range.begin, end});
        left_out_.push_back({end, range.end});
    }
    return kept;
}

Status RenderJob::begin_fewer(bool stop) {
    RAYPAGER_TRY(settle());
    RAYPAGER_TRY(end_first_pass());
    std::vector<SampleRange> in_pool = pool_.ranges();
    pool_.cut(0);
    pool_.add(shorten(std::move(in_pool), false, stop));
    windows_.replace_left(shorten(windows_.left(), false, stop));
    uint64_t to_begin = begun_before_ + pool_.left() + windows_.numbers_left();
    for (size_t i = 0; i < devices_.count(); i++) {
        Wavefront& w = devices_.worker(i).wavefront();
        std::vector<SampleRange> left = shorten(w.numbers().from(w.samples_begun()), true, stop);
        w.numbers().cut(w.samples_begun());
        for (const SampleRange& range : left) w.numbers().append(range);
        to_begin += w.numbers().count();
    }
    left_out_ = merge_ranges(std::move(left_out_));
    shortened_ = shortened_ || (stop && to_begin < samples_to_begin_);
    samples_to_begin_ = to_begin;
    return stop && !keeps_film() && !wavefront().begins_again() ? begin_coarse() : Status();
}

// Where there is no time for the whole first pass, the rest of the picture becomes a coarse one.
Status RenderJob::begin_coarse() {
    Wavefront& w = wavefront();
    const uint64_t begun = samples_begun(), left = w.numbers().count() - w.samples_begun();
    const double each = begun > 0 ? render_seconds() / static_cast<double>(begun) : 1e-6;
    if (w.numbers().from(w.samples_begun()).size() != 1 || static_cast<double>(left) * each <= options_.stop_seconds / 2) return {};
    constexpr double most = 1 << 22;
    const double in_time = std::clamp(options_.stop_seconds / each, 4096.0, most);
    const rp_render_params& params = w.params();
    auto samples = coarse_samples(params.order, begun, params.width, params.height, static_cast<uint64_t>(in_time));
    w.numbers().cut(w.samples_begun());
    samples_to_begin_ += samples.size() - left;
    begun_before_ += samples.size();
    w.begin_with(std::move(samples));
    return {};
}

}  // namespace raypager
