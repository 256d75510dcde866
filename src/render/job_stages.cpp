// Stages of adaptive sampling, as a render goes through them.
#include "render/job.hpp"

namespace raypager {

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

Status RenderJob::begin_adaptive() {
    const rp_render_params& params = wavefront().params();
    const AdaptiveSettings settings = {params.adaptive_error, params.width, params.height, params.spp, params.order.tile_size};
    adaptive_.emplace(settings, FilmLayout(params));
    if (!checkpointer_->resumed()) return {};
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
