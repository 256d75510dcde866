// What of a render comes in steps: the first pass that goes coarse to fine, and the stages of adaptive sampling.
#include "render/job.hpp"

namespace raypager {

// Of a checkpoint every sample is known by its number or because its path is under way; a recording is one of the usual order.
bool RenderJob::goes_coarse_first(const rp_render_params& params) const {
    return options_.coarse_first && params.adaptive_error == 0 && !checkpointer_->enabled() && instruments_.record_paths == 0;
}

// Until all of them have begun, no samples are begun by number: those of the first pass count as begun already.
Status RenderJob::begin_first_pass() {
    const rp_render_params& params = wavefront().params();
    first_pass_ = FirstPass(params.order, params.width, params.height);
    all_samples_ = params.sample_limit;
    in_first_pass_ = true;
    RAYPAGER_TRY(wavefront().set_sample_limit(params.first_sample));
    wavefront().expect_more(true);
    wavefront().begin_with(first_pass_.take_step());
    return {};
}

Status RenderJob::go_on_with_first_pass() {
    if (!in_first_pass_ || stopped_ || wavefront().begins_again()) return {};
    if (!first_pass_.pending()) return end_first_pass();
    if (!first_pass_.due(rounds_->ready_rays() + rounds_->counters().waiting_rays())) return {};
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
    return wavefront().set_sample_limit(all_samples_);
}

Status RenderJob::read_for_stage() {
    adaptive_->begin_taking();
    return for_film_pieces([this](uint64_t, std::span<uint32_t> words) -> Status {
        adaptive_->take(words);
        return {};
    });
}

Status RenderJob::begin_stage(const SampleStage& stage) {
    return wavefront().begin_stage(stage.begin, stage.first_sample, stage.passes, stage.pixels);
}

Status RenderJob::begin_adaptive(bool resumed) {
    const rp_render_params& params = wavefront().params();
    const AdaptiveSettings settings = {params.adaptive_error, params.width, params.height, params.spp, params.order.tile_size};
    adaptive_.emplace(settings, FilmLayout(params));
    if (!resumed) return {};
    RAYPAGER_TRY(read_for_stage());
    const auto stage = adaptive_->resume(params.first_sample);
    if (!stage) return stage.status().at(options_.checkpoint.file.string());
    return stage->passes > 0 ? begin_stage(*stage) : Status();
}

// Once the last path of a stage has ended, the film says which pixels go on.
Status RenderJob::end_stage() {
    const bool under_way = rounds_->ready_rays() > 0 || rounds_->counters().waiting_rays() > 0 || wavefront().begins_again();
    if (under_way || stopped_ || samples_begun() < wavefront().params().sample_limit) return {};
    RAYPAGER_TRY(settle());
    last_stage_ended_ = late_ || stop_began_;
    shortened_ = shortened_ || stop_began_;  // of stages that do not come any more
    if (last_stage_ended_) return {};
    watchdog_->doing("choosing pixels");
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
        return wavefront().write_film(first, piece);
    }));
    RAYPAGER_TRY(begin_stage(stage));
    between_stages_ = false;
    return {};
}

}  // namespace raypager
