// A render from start to end: which samples are taken, the film, checkpoints, callbacks, and when it stops. What the device does is DeviceRounds'
// part.
#pragma once

#include <atomic>
#include <chrono>
#include <memory>
#include <optional>
#include <string>

#include "film/film.hpp"
#include "render/adaptive.hpp"
#include "render/checkpointer.hpp"
#include "render/device_rounds.hpp"
#include "render/first_pass.hpp"
#include "render/recorder.hpp"
#include "render/render.hpp"
#include "render/watchdog.hpp"

namespace raypager {

class RenderJob {
public:
    // What is handed in outlives the job.
    RenderJob(const BlockSource& source, const RenderOptions& options, const RenderCallbacks& callbacks, const RenderInstruments& instruments)
        : source_(source), scene_(source.scene()), options_(options), callbacks_(callbacks), instruments_(instruments) {}

    // Opens the device and makes everything on it.
    Status prepare();
    bool done() const { return (rounds_->all_idle() && !more_to_begin()) || stopped_ || last_stage_ended_; }
    // One round, and what is due after it. REQUIRES: !done().
    Status step();
    // Whether a lack of progress is to be reported: not while nobody asks for a step, as at first.
    void expect_progress(bool expected) { expected ? watchdog_->resume() : watchdog_->pause(); }
    // Ends rounds under way, and writes the last checkpoint. Then the result.
    Result<MeasuredRender> finish();

    RenderProgress progress() const;
    Result<Image> picture(double* spp = nullptr);  // so far
    Result<std::vector<FilmLayerImage>> layers_at(uint32_t x, uint32_t y);
    std::vector<BlockStatus> blocks() const;
    Status write_checkpoint();
    void cancel() { cancelled_ = true; }  // from any thread; the job is done after the round under way

    // Once the camera or the size in the options has changed: whether it can begin anew with them, and then that.
    Status check_restart() const;
    Status restart();
    // Once the limits of geometry in the options have changed: whether they would do, and then going on within them.
    Status check_limits() const;
    uint32_t region() const { return wavefront().params().order.region; }  // that the plan must not choose anew then
    Status go_on_within_limits();

private:
    using Clock = std::chrono::steady_clock;
    Status finish_round();
    Status settle();
    // Before the first round has ended, nothing has been counted yet.
    uint64_t samples_begun() const { return rounds_->has_counted() ? rounds_->counters().next_sample() : wavefront().params().first_sample; }
    uint64_t samples_to_begin() const { return (in_first_pass_ ? all_samples_ : wavefront().params().sample_limit) + coarse_ - left_out_; }
    Status wait_for_block();
    Status end_early();
    Status begin_adaptive(bool resumed);
    bool goes_coarse_first(const rp_render_params& params) const;
    Status begin_first_pass();
    Status go_on_with_first_pass();
    Status end_first_pass();
    Status begin_parts();
    Status go_on_with_parts();
    // Although no path is under way.
    bool more_to_begin() const { return in_first_pass_ || wavefront().begins_again() || part_begins_; }
    void watch();
    Status end_stage();
    uint64_t most_pixels() const { return uint64_t{full_width_} * full_height_; }
    Result<rp_render_params> full_size_params() const;
    Status read_for_stage();
    Status begin_stage(const SampleStage& stage);
    Status for_film_pieces(const std::function<Status(uint64_t first_word, std::span<uint32_t> words)>& see);
    Status begin_fewer(bool stop);
    Status keep_checkpoint();
    Status report_progress();
    Status snapshot(double now);
    void warn(const std::string& message) const;
    Status with_advice(const Status& error) const;
    WorkDone work() const;
    Result<FilmResolver> read_film(FilmUse use = FilmUse::all);
    Result<MeasuredRender> result();
    RenderReport make_report(const FilmResolver& film) const;
    Wavefront& wavefront() { return rounds_->wavefront(); }
    const Wavefront& wavefront() const { return rounds_->wavefront(); }
    double render_seconds() const { return std::chrono::duration<double>(Clock::now() - render_start_).count(); }

    const BlockSource& source_;
    const BakedScene& scene_;
    const RenderOptions& options_;
    const RenderCallbacks& callbacks_;
    const RenderInstruments& instruments_;
    std::optional<Checkpointer> checkpointer_;
    std::unique_ptr<DeviceRounds> rounds_;
    std::unique_ptr<Watchdog> watchdog_;  // asks rounds_: destroyed before it
    RenderRecorder recorder_;
    WorkDone earlier_;  // by runs before this one
    WorkDone outside_;  // what the device did before a restart: not of this render
    std::optional<AdaptiveSampling> adaptive_;
    bool last_stage_ended_ = false;  // of adaptive sampling
    bool between_stages_ = false;    // an error has ended the render there: its film is of neither
    FirstPass first_pass_;           // coarse to fine
    bool in_first_pass_ = false;     // some of it have not begun
    uint64_t all_samples_ = 0;       // the limit behind it
    std::vector<SamplePart> parts_;  // of RenderInstruments: those that are left
    bool part_begins_ = false;       // with the next round
    uint64_t left_out_ = 0;          // samples before the present part and between those that were begun
    uint64_t pixels_ = 0;
    uint32_t full_width_ = 0, full_height_ = 0;  // for as many pixels there is memory
    std::atomic<bool> cancelled_{false};
    bool late_ = false;                 // time is up: few samples begin any more
    std::optional<double> stop_began_;  // the same, because of a stop from outside
    bool shortened_ = false;            // by a stop, which takes samples from the picture
    bool stopped_ = false;              // here and now
    uint64_t coarse_ = 0;               // samples that are begun in an order of their own then
    double snapshot_seconds_ = 0, snapshot_interval_ = 0;
    Clock::time_point start_ = Clock::now(), render_start_ = start_;
    double next_progress_ = 0, next_snapshot_ = 0, last_reported_ = 0;
    uint64_t last_rays_ = 0;
    double rate_ = 0;
};

}  // namespace raypager
