// What may change while a render runs: the view, with which it begins anew, and the limits, within which it goes on. And what can be seen of it then.
#include <utility>

#include "render/job.hpp"
#include "render/params.hpp"

namespace raypager {

Status RenderJob::check_restart() const {
    if (options_.peers) return Status::usage("a render that several processes share cannot begin anew");
    if (checkpointer_->enabled()) return Status::usage("a render with a checkpoint cannot begin anew; leave the checkpoint out");
    RAYPAGER_TRY(check_whole_film());
    if (instruments_.record_paths > 0 || instruments_.keep_journal) return Status::usage("a render that is recorded cannot begin anew");
    const auto params = make_params(scene_, options_);
    if (!params) return params.status();
    if (uint64_t{params->width} * params->height <= most_pixels()) return {};
    return Status::usage("the session has memory for no more pixels than it was created with");
}

Status RenderJob::restart() {
    RAYPAGER_TRY(settle(true));
    auto params = make_params(scene_, options_);
    if (!params) return params.status();
    const rp_render_params& old = wavefront().params();
    const uint64_t pixels = uint64_t{params->width} * params->height;
    if (pixels == pixels_) params->order = old.order;  // the plan may have chosen regions
    pixels_ = pixels;
    outside_ = {};
    earlier_ = {};
    const WorkDone before = work();
    pool_.clear();
    left_out_.clear();
    RAYPAGER_TRY(on_each_device([&](DeviceWorker& worker) { return worker.restart(*params); }));
    devices_.note_figures();
    outside_ = before;
    begun_before_ = 0;
    sample_limit_ = samples_to_begin_ = params->stage_begin;
    pool_.add({{0, sample_limit_}});
    RAYPAGER_TRY(begin_kept_film());
    adaptive_.reset();
    first_pass_ = {};
    in_first_pass_ = false;
    last_stage_ended_ = between_stages_ = late_ = shortened_ = stopped_ = false;
    stop_began_.reset();
    snapshot_seconds_ = rate_ = last_reported_ = 0;
    last_rays_ = 0;
    if (params->adaptive_error > 0) RAYPAGER_TRY(begin_adaptive(std::nullopt));
    if (goes_coarse_first(*params)) RAYPAGER_TRY(begin_first_pass());
    start_ = render_start_ = Clock::now();
    next_progress_ = 0;
    next_slow_check_ = first_slow_check;
    next_snapshot_ = snapshot_interval_ = options_.snapshot_seconds;
    return {};
}

Status RenderJob::check_whole_film() const {
    if (!has_windows()) return {};
    return Status::usage("the film does not fit into device memory as a whole, so the render cannot be changed; give a larger --memory-limit");
}

Status RenderJob::check_limits() const {
    if (options_.peers) return Status::usage("a render that several processes share keeps its limits");
    if (late_ || stop_began_) return Status::usage("the render is about to end");
    RAYPAGER_TRY(check_whole_film());
    if (instruments_.record_paths > 0 || instruments_.keep_journal) return Status::usage("the limits of a render that is recorded are fixed");
    if (options_.tuning.pool_place == PoolPlace::host) return Status::usage("all geometry is in host memory; there is no limit to change");
    const DeviceRounds& rounds = first().rounds();
    auto params = full_size_params();
    if (!params) return params.status();
    params->order = wavefront().params().order;
    const auto plan = plan_render(scene_, options_, instruments_, *params, rounds.device().info(), rounds.device().budget().limit(), rounds.share());
    if (!plan) return plan.status();
    return plan->params.film_rows == params->height ? Status() : Status::usage("within such limits the film would not fit as a whole");
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
    RAYPAGER_TRY(settle(true));
    std::vector<uint32_t> film(film_words());
    RAYPAGER_TRY(collect_films());
    RAYPAGER_TRY(read_words(0, film));
    if (in_first_pass_) pool_.add({{pixels_, sample_limit_}});
    Checkpointer::Contents contents;
    RAYPAGER_TRY(take_contents(contents));
    const std::vector<rp_path_sample> rest = first_pass_.take_rest();
    in_first_pass_ = false;
    contents.under_way.insert(contents.under_way.end(), rest.begin(), rest.end());
    CheckpointState state;
    set_left(state, contents.left, sample_limit_);
    auto params = make_params(scene_, options_);
    auto full = full_size_params();
    if (!params || !full) return params ? full.status() : params.status();
    params->order = full->order = wavefront().params().order;

    const uint64_t begun = samples_begun();
    WorkDone done = contents.work;
    done.render_seconds = earlier_.render_seconds;  // which goes on
    done.runs = earlier_.runs;
    earlier_ = done;
    outside_ = {};
    last_rays_ = 0;
    last_reported_ = render_seconds();
    pool_.clear();
    // The cache of blocks goes with the last of them, and the first that is made has the next one.
    std::vector<DeviceShare> shares;
    std::vector<std::unique_ptr<Device>> devices;
    for (size_t i = 0; i < devices_.count(); i++) {
        shares.push_back(devices_.worker(i).rounds().share());
        shares.back().shared_caches.clear();
        shares.back().order_is_given = true;
        devices.push_back(devices_.worker(i).release_device());
    }
    std::vector<std::shared_ptr<HostCache>> caches;
    RAYPAGER_TRY(on_each_device([&](DeviceWorker& worker) -> Status {
        DeviceShare share = std::move(shares.front());
        shares.erase(shares.begin());
        std::unique_ptr<Device> device = std::move(devices.front());
        devices.erase(devices.begin());
        share.shared_caches = caches;
        auto rounds = DeviceRounds::create(blocks_from(), options_, instruments_, *full, std::move(device), share,
                                           [this](const std::string& text) { warn(text); });
        if (!rounds) return devices_.several() ? Status::device(rounds.status().message()) : rounds.status();
        caches.push_back((*rounds)->residency().cache());
        worker.take_rounds(std::move(*rounds));
        return pixels_ < most_pixels() ? worker.restart(*params) : Status();
    }));
    RAYPAGER_TRY(check_whole_film());
    devices_.note_figures();
    begun_before_ = begun;
    RAYPAGER_TRY(write_words(0, film));
    // Where sampling is adaptive, what is left of a stage comes with it.
    if (params->adaptive_error > 0) sample_limit_ = samples_to_begin_ = params->stage_begin;
    pool_.add(ranges_left(state, sample_limit_));
    pool_.add_again(contents.under_way);
    return params->adaptive_error > 0 ? begin_adaptive(state.next_sample) : Status();
}

// Of several devices, the first one's.
std::vector<BlockStatus> RenderJob::blocks() {
    std::vector<BlockStatus> result;
    result.reserve(scene_.blocks.size());
    if (devices_.several() && !settle(true)) return result;  // the next step says why
    for (const BlockState& block : first().rounds().residency().blocks().first(scene_.blocks.size())) {
        const auto state = block.state == PageState::resident  ? BlockStatus::State::resident
                           : block.state == PageState::loading ? BlockStatus::State::on_its_way
                                                               : BlockStatus::State::absent;
        result.push_back({state, block.requests});
    }
    return result;
}

}  // namespace raypager
