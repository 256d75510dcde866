// What may change while a render runs: the view, with which it begins anew, and the limits, within which it goes on. And what can be seen of it then.
#include <utility>

#include "render/job.hpp"
#include "render/params.hpp"

namespace raypager {

void RenderJob::watch() {
    watchdog_ = std::make_unique<Watchdog>(
        options_.stall_seconds, [this] { return rounds_->residency().loader_activity(); }, [this](const std::string& text) { warn(text); });
    watchdog_->pause();
}

Status RenderJob::check_restart() const {
    if (checkpointer_->enabled()) return Status::usage("a render with a checkpoint cannot begin anew; leave the checkpoint out");
    if (instruments_.record_paths > 0 || instruments_.keep_journal) return Status::usage("a render that is recorded cannot begin anew");
    const auto params = make_params(scene_, options_);
    if (!params) return params.status();
    if (uint64_t{params->width} * params->height <= most_pixels()) return {};
    return Status::usage("the session has memory for no more pixels than it was created with");
}

Status RenderJob::restart() {
    RAYPAGER_TRY(settle());
    auto params = make_params(scene_, options_);
    if (!params) return params.status();
    const rp_render_params& old = wavefront().params();
    const uint64_t pixels = uint64_t{params->width} * params->height;
    if (pixels == pixels_) params->order = old.order;  // the plan may have chosen regions
    pixels_ = pixels;
    if (goes_coarse_first(*params)) params->first_sample = pixels_;
    outside_ = {};
    earlier_ = {};
    const WorkDone before = work();
    RAYPAGER_TRY(rounds_->restart(*params));
    outside_ = before;
    adaptive_.reset();
    first_pass_ = {};
    in_first_pass_ = false;
    last_stage_ended_ = between_stages_ = late_ = shortened_ = stopped_ = false;
    stop_began_.reset();
    coarse_ = 0;
    snapshot_seconds_ = rate_ = last_reported_ = 0;
    last_rays_ = 0;
    if (params->adaptive_error > 0) RAYPAGER_TRY(begin_adaptive(false));
    if (goes_coarse_first(*params)) RAYPAGER_TRY(begin_first_pass());
    start_ = render_start_ = Clock::now();
    next_progress_ = 0;
    next_snapshot_ = snapshot_interval_ = options_.snapshot_seconds;
    return {};
}

Status RenderJob::check_limits() const {
    if (late_ || stop_began_) return Status::usage("the render is about to end");
    if (instruments_.record_paths > 0 || instruments_.keep_journal) return Status::usage("the limits of a render that is recorded are fixed");
    if (options_.tuning.pool_place == PoolPlace::host) return Status::usage("all geometry is in host memory; there is no limit to change");
    const Device& device = rounds_->device();
    const auto params = full_size_params();
    if (!params) return params.status();
    return plan_render(scene_, options_, instruments_, *params, device.info(), device.budget().limit()).status();
}

// Of the largest view that there may be: memory is divided for that one.
Result<rp_render_params> RenderJob::full_size_params() const {
    RenderOptions options = options_;
    options.width = full_width_;
    options.height = full_height_;
    return make_params(scene_, options);
}

// As from a checkpoint that lies in main memory.
Status RenderJob::go_on_within_limits() {
    RAYPAGER_TRY(settle());
    std::vector<rp_path_sample> samples;
    RAYPAGER_TRY(wavefront().read_samples_under_way(samples));
    const std::vector<rp_path_sample> rest = first_pass_.take_rest();
    in_first_pass_ = false;
    samples.insert(samples.end(), rest.begin(), rest.end());
    std::vector<uint32_t> film(wavefront().film_words());
    RAYPAGER_TRY(wavefront().read_film(0, film));
    auto params = make_params(scene_, options_);
    auto full = full_size_params();
    if (!params || !full) return params ? full.status() : params.status();
    params->order = full->order = wavefront().params().order;
    params->first_sample = full->first_sample = samples_begun();

    WorkDone done = work();
    done.render_seconds = earlier_.render_seconds;  // which goes on
    done.runs = earlier_.runs;
    earlier_ = done;
    outside_ = {};
    last_rays_ = 0;
    last_reported_ = render_seconds();
    watchdog_.reset();
    std::unique_ptr<Device> device = rounds_->release_device();
    auto rounds = DeviceRounds::create(source_, options_, instruments_, *full, std::move(device), [this](const std::string& text) { warn(text); });
    if (!rounds) return rounds.status();
    rounds_ = std::move(*rounds);
    if (pixels_ < most_pixels()) RAYPAGER_TRY(rounds_->restart(*params));
    watch();
    RAYPAGER_TRY(wavefront().write_film(0, film));
    wavefront().begin_with(std::move(samples));
    return params->adaptive_error > 0 ? begin_adaptive(true) : Status();
}

Result<std::vector<FilmLayerImage>> RenderJob::layers_at(uint32_t x, uint32_t y) {
    RAYPAGER_TRY(settle());
    const FilmLayout layout(wavefront().params());
    std::vector<uint32_t> words(layout.words());
    RAYPAGER_TRY(wavefront().read_film((uint64_t{y} * wavefront().params().width + x) * layout.words(), words));
    LayerResolver layers(1, 1, layout);
    layers.add(words, words[RP_FILM_COUNT] & RP_FILM_COUNT_MASK);
    return layers.take();
}

std::vector<BlockStatus> RenderJob::blocks() const {
    std::vector<BlockStatus> result;
    result.reserve(scene_.blocks.size());
    for (const BlockState& block : rounds_->residency().blocks().first(scene_.blocks.size())) {
        const auto state = block.state == PageState::resident  ? BlockStatus::State::resident
                           : block.state == PageState::loading ? BlockStatus::State::on_its_way
                                                               : BlockStatus::State::absent;
        result.push_back({state, block.requests});
    }
    return result;
}

}  // namespace raypager
