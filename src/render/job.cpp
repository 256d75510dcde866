#include "render/job.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "base/check.hpp"
#include "base/log.hpp"
#include "render/params.hpp"

namespace raypager {

Status RenderJob::prepare() {
    RAYPAGER_TRY(check_instruments(options_, instruments_));
    auto params = make_params(scene_, options_);
    if (!params) return params.status();
    pixels_ = uint64_t{params->width} * params->height;
    full_width_ = params->width;
    full_height_ = params->height;
    RAYPAGER_TRY(make_devices(*params));
    earlier_ = checkpointer_->earlier_work();
    begun_before_ = checkpointer_->begun();
    sample_limit_ = samples_to_begin_ = params->stage_begin;
    // With other processes, numbers that nobody has begun yet are taken by all.
    if (options_.peers) {
        RAYPAGER_TRY(share_checkpoint());
    } else {
        pool_.add(checkpointer_->left(sample_limit_));
        pool_.add_again(checkpointer_->under_way());
    }
    if (instruments_.parts) {
        RAYPAGER_CHECK(!checkpointer_->enabled() && params->adaptive_error == 0);
        pool_.clear();
        pool_.add(instruments_.parts(wavefront().params()));
        samples_to_begin_ = pool_.left();
    }
    RAYPAGER_TRY(begin_kept_film());
    RAYPAGER_TRY(checkpointer_->restore([this](uint64_t first, std::span<const uint32_t> words) { return write_words(first, words); }));
    const uint64_t next_sample = options_.peers ? common_begin_ : checkpointer_->next_sample();
    if (params->adaptive_error > 0) RAYPAGER_TRY(begin_adaptive(resumed_ ? std::optional(next_sample) : std::nullopt));
    if (goes_coarse_first(*params)) RAYPAGER_TRY(begin_first_pass());
    if (has_windows()) RAYPAGER_TRY(begin_windows());
    recorder_.begin(options_.tuning, instruments_, wavefront().params(), first().rounds().device().info().cpu_cores());
    render_start_ = Clock::now();
    checkpointer_->begin();
    next_snapshot_ = snapshot_interval_ = options_.snapshot_seconds;
    warn_of_waits();
    if (options_.tuning.pool_place == PoolPlace::host) RAYPAGER_TRY(first().rounds().residency().load_all(first().rounds().device().kernels()));
    if (callbacks_.begins) callbacks_.begins();
    return {};
}

Status RenderJob::step() {
    const auto round = [this]() -> Status {
        RAYPAGER_TRY(devices_.step());
        RAYPAGER_TRY(drop_failed());
        RAYPAGER_TRY(end_early());
        if (options_.peers) {
            RAYPAGER_TRY(act_with_peers());
            return report_progress();
        }
        if (adaptive_) RAYPAGER_TRY(end_stage());
        RAYPAGER_TRY(go_on_with_windows());
        RAYPAGER_TRY(go_on_with_first_pass());
        if (checkpointer_->due()) RAYPAGER_TRY(keep_checkpoint());
        return report_progress();
    };
    const Status status = round();
    return status ? status : with_advice(status);
}

Result<MeasuredRender> RenderJob::finish() {
    Status status = collect_all();
    if (status && options_.peers)
        status = finish_with_peers();
    else if (status && checkpointer_->enabled())
        status = keep_checkpoint();
    if (status) status = settle(true);
    if (!status) return with_advice(status);
    auto finished = result();
    return finished ? std::move(finished) : with_advice(finished.status());
}

// A device may fail even now; then what it has done is done again.
Status RenderJob::collect_all() {
    for (const bool was_done = done();;) {
        RAYPAGER_TRY(settle());
        const size_t devices = devices_.count();
        RAYPAGER_TRY(collect_films());
        if (devices_.count() == devices) return settle(true);
        while (was_done && !done()) RAYPAGER_TRY(step());
    }
}

// Ends all rounds under way, so that the counters are those of the state on the devices.
Status RenderJob::settle(bool still) {
    do {
        RAYPAGER_TRY(devices_.settle(still));
    } while (devices_.failed().worker && drop_failed());
    return drop_failed();
}

bool RenderJob::all_ended() const {
    if (options_.peers) return finished_;
    if (devices_.several()) return devices_.idle();
    return device_ended() && !windows_.any_left() && !in_first_pass_ && !adaptive_;  // stages end by themselves
}

// Of one device.
bool RenderJob::device_ended() const {
    const WorkerFigures only = devices_.figures().front();
    return only.all_idle && !only.begins_again && pool_.left() == 0 && pool_.again().empty();
}

uint64_t RenderJob::samples_begun() const {
    uint64_t begun = begun_before_;
    for (const WorkerFigures& f : devices_.figures()) begun += f.begun;
    return begun;
}

// When time is up, or a stop is asked for, few camera paths begin any more (wavefront/sample_order.hpp), and all paths finish; but after a stop they
// do not get long for it, and with a checkpoint, which keeps them, no time at all.
Status RenderJob::end_early() {
    if (options_.peers) return {};  // they end together
    const auto is_set = [](const std::atomic<bool>* flag) { return flag != nullptr && flag->load(); };
    if (all_ended()) return {};
    const double now = render_seconds();
    const bool at_once = cancelled_ || is_set(options_.stop_now), stop = at_once || is_set(options_.stop), first = stop && !stop_began_;
    if (first) stop_began_ = now;
    stopped_ = stop && (checkpointer_->enabled() || at_once || now - *stop_began_ >= options_.stop_seconds);
    const bool late = !late_ && options_.time_seconds > 0 && now >= options_.time_seconds;
    late_ = late_ || late;
    return !stopped_ && (first || late) ? begin_fewer(stop) : Status();
}

// A checkpoint that cannot be written is no reason to end: the disk may have room again the next time.
Status RenderJob::keep_checkpoint() {
    if (between_stages_) return {};
    RAYPAGER_TRY(settle());
    devices_.doing("writing the checkpoint");
    RAYPAGER_TRY(collect_films());
    const Status status = save_checkpoint();
    if (!status) warn(status.message() + "; the checkpoint before it stays, and the render goes on");
    return {};
}

Status RenderJob::write_checkpoint() {
    if (options_.peers) return Status::usage("a render that several processes share writes its checkpoints by itself");
    if (!checkpointer_->enabled()) return Status::usage("there is no checkpoint file; name one in the options");
    if (between_stages_) return Status::failed("the render failed between two stages; the checkpoint before it stays");
    RAYPAGER_TRY(settle());
    RAYPAGER_TRY(collect_films());
    return save_checkpoint();
}

// REQUIRES: settled, and films are collected.
Status RenderJob::save_checkpoint() {
    Checkpointer::Contents contents;
    RAYPAGER_TRY(take_contents(contents));
    return checkpointer_->write(std::move(contents), [this](uint64_t first, std::span<uint32_t> words) { return read_words(first, words); });
}

Status RenderJob::take_contents(Checkpointer::Contents& contents) {
    contents.limit = sample_limit_;
    contents.left = left_out_;
    contents.under_way = pool_.again();
    contents.work = work();
    const std::vector<SampleRange> in_pool = pool_.ranges();
    contents.left.insert(contents.left.end(), in_pool.begin(), in_pool.end());
    contents.left.insert(contents.left.end(), windows_.left().begin(), windows_.left().end());
    contents.under_way.insert(contents.under_way.end(), windows_.again().begin(), windows_.again().end());
    std::vector<rp_path_sample> samples;
    for (size_t i = 0; i < devices_.count(); i++) {
        Wavefront& w = devices_.worker(i).wavefront();
        const std::vector<SampleRange> left = w.numbers().from(w.samples_begun());
        contents.left.insert(contents.left.end(), left.begin(), left.end());
        // Of devices whose films are collected they are known, whatever has become of the device.
        if (keeps_film())
            samples = devices_.worker(i).again_since_film();
        else
            RAYPAGER_TRY(devices_.worker(i).rounds().read_samples_under_way(samples));
        contents.under_way.insert(contents.under_way.end(), samples.begin(), samples.end());
    }
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
    for (const WorkerFigures& f : devices_.figures()) sum += f.work;
    sum.render_seconds += render_seconds();
    sum.runs++;
    sum.stall_seconds -= outside_.stall_seconds;
    sum.loads -= outside_.loads;
    sum.evictions -= outside_.evictions;
    sum.bytes_loaded -= outside_.bytes_loaded;
    sum.rounds -= outside_.rounds;
    return sum;
}

}  // namespace raypager
