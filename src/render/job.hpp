// A render from start to end: which samples are taken, the film, checkpoints, callbacks, and when it stops. What devices do is the part of
// DeviceGroup and what is below it.
#pragma once

#include <atomic>
#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "film/add_films.hpp"
#include "film/film.hpp"
#include "render/adaptive.hpp"
#include "render/checkpointer.hpp"
#include "render/device_group.hpp"
#include "render/film_windows.hpp"
#include "render/first_pass.hpp"
#include "render/recorder.hpp"
#include "render/render.hpp"
#include "store/sharded_blocks.hpp"

namespace raypager {

class RenderJob {
public:
    // What is handed in outlives the job.
    RenderJob(const BlockSource& source, const RenderOptions& options, const RenderCallbacks& callbacks, const RenderInstruments& instruments)
        : source_(source), scene_(source.scene()), options_(options), callbacks_(callbacks), instruments_(instruments) {}

    ~RenderJob();
    RenderJob(const RenderJob&) = delete;
    RenderJob& operator=(const RenderJob&) = delete;

    // Opens the devices and makes everything on them.
    Status prepare();
    bool done() const { return all_ended() || stopped_ || last_stage_ended_; }
    // One round, and what is due after it; with several devices, what they do in some milliseconds. REQUIRES: !done().
    Status step();
    // Whether a lack of progress is to be reported: not while nobody asks for a step, as at first.
    void expect_progress(bool expected) { devices_.expect_progress(expected); }
    // Ends rounds under way, and writes the last checkpoint. Then the result.
    Result<MeasuredRender> finish();

    RenderProgress progress() const;
    Result<Image> picture(double* spp = nullptr);  // so far
    Result<std::vector<FilmLayerImage>> layers_at(uint32_t x, uint32_t y);
    std::vector<BlockStatus> blocks();
    Status write_checkpoint();
    void cancel() { cancelled_ = true; }  // from any thread; the job is done after the round under way

    Status hold() { return settle(true); }  // until the next step
    // Once the camera or the size in the options has changed: whether it can begin anew with them, and then that.
    Status check_restart() const;
    Status restart();
    // Once the limits of geometry in the options have changed: whether they would do, and then going on within them.
    Status check_limits() const;
    uint32_t region() const { return wavefront().params().order.region; }  // that the plan must not choose anew then
    Status go_on_within_limits();

private:
    using Clock = std::chrono::steady_clock;
    Status settle(bool still = false);
    Status collect_all();
    bool all_ended() const;
    bool device_ended() const;
    uint64_t samples_begun() const;
    Status end_early();
    Status keep_checkpoint();
    Status save_checkpoint();
    Status take_contents(Checkpointer::Contents& contents);
    void warn(const std::string& message) const;
    Status with_advice(const Status& error) const;
    WorkDone work() const;
    double render_seconds() const { return std::chrono::duration<double>(Clock::now() - render_start_).count(); }

    // job_devices.cpp: making them, and going on without those that fail.
    Status check_several() const;
    Status make_devices(rp_render_params& params);
    Result<std::vector<DeviceShare>> choose_shares(DeviceInfo& first) const;
    Status open_checkpoint(rp_render_params& params, const DeviceInfo& device);
    std::vector<Result<std::unique_ptr<DeviceRounds>>> make_all_rounds(rp_render_params& params, std::vector<DeviceShare>& shares);
    Result<std::unique_ptr<Device>> open_device(const DeviceShare& share) const;
    Result<std::unique_ptr<DeviceRounds>> make_rounds(const rp_render_params& params, const DeviceShare& share,
                                                      Result<std::unique_ptr<Device>> device);
    void drop(const DeviceGroup::Failure& failure);
    Status drop_failed();
    // Those that fail are dropped, as long as there is another one. REQUIRES: settled.
    Status on_each_device(const std::function<Status(DeviceWorker&)>& act);
    const BlockSource& blocks_from() const { return sharded_ ? *sharded_ : source_; }
    DeviceWorker& first() { return devices_.worker(0); }
    const DeviceWorker& first() const { return devices_.worker(0); }
    Wavefront& wavefront() { return first().wavefront(); }
    const Wavefront& wavefront() const { return first().wavefront(); }

    // The device has one part of the film at a time.
    bool has_windows() const { return wavefront().params().film_rows < wavefront().params().height; }
    // Devices add to a film in host memory: several, or one that has a part at a time.
    bool keeps_film() const { return devices_.several() || options_.peers || has_windows(); }

    // job_peers.cpp: what other processes have to do with it.
    enum class PeerAction : uint8_t { checkpoint = 1, snapshot, stage, late, stop_soon, stop, finish };
    Status begin_with_peers(rp_render_params& params, const DeviceInfo& device);
    Status share_blocks(const DeviceInfo& device);
    Status share_checkpoint();
    Status ask_to_stop();
    Result<bool> all_agree(bool agrees);
    uint64_t common_end() const;
    bool takes_no_more() const;
    Status take_from_peers();
    Status act_with_peers();
    Result<std::optional<PeerAction>> next_action();
    Status say_idle(bool idle);
    Status act(PeerAction what);
    Status film_to_first(const std::function<Status(std::span<uint32_t>)>& see);
    Status gather_contents(Checkpointer::Contents& contents);
    Status checkpoint_of_all();
    Status share_film_for_stage();
    Status stage_of_all();
    Status restart_common(uint64_t from);
    Status finish_with_peers();

    // job_progress.cpp: how far it is; on rank 0 of several processes, with what others have told.
    struct Standing {
        int64_t begun = 0;  // samples, without those that are to be begun again
        WorkDone work;
        std::vector<std::vector<WorkerFigures>> devices;  // by rank
    };
    int64_t begun_here(const std::vector<WorkerFigures>& devices) const;
    Status tell_progress();
    Standing standing() const;
    RenderProgress progress_at(const Standing& all) const;
    void warn_if_slow(double now);
    void warn_of_waits();
    void warn_that_it_crawls(const std::string& why);
    Status report_progress();

    // job_film.cpp: the film, of all devices together, and what becomes of it.
    Status read_words(uint64_t first_word, std::span<uint32_t> words);
    Status write_words(uint64_t first_word, std::span<const uint32_t> words);
    Status collect_films();
    Status begin_kept_film();
    uint64_t film_words() const { return FilmLayout(wavefront().params()).words() * pixels_; }
    std::span<uint32_t> film_of_devices();
    Status collect_film(DeviceWorker& worker);
    Status for_film_pieces(const std::function<Status(uint64_t first_word, std::span<uint32_t> words)>& see);
    Result<FilmResolver> read_film(FilmUse use = FilmUse::all);
    Status snapshot(double now);
    Result<MeasuredRender> result();
    Status check_alone() const;
    static RenderReport::DeviceWork device_work(const DeviceWorker& worker);
    uint64_t peak_host_bytes() const;
    RenderReport make_report(const FilmResolver& film) const;

    // job_stages.cpp: what comes in steps, and where it ends before its time.
    Status begin_adaptive(std::optional<uint64_t> next_sample);
    bool stage_has_ended() const;
    Status end_stage();
    Status begin_windows();
    Status go_on_with_windows();
    Status begin_window();
    Status read_for_stage();
    Status begin_stage(const SampleStage& stage, std::vector<SampleRange> left);
    bool goes_coarse_first(const rp_render_params& params) const;
    Status begin_first_pass();
    Status go_on_with_first_pass();
    Status end_first_pass();
    Status begin_fewer(bool stop);
    Status begin_coarse();
    std::vector<SampleRange> shorten(std::vector<SampleRange> ranges, bool begun, bool stop);

    // job_changes.cpp
    uint64_t most_pixels() const { return uint64_t{full_width_} * full_height_; }
    Result<rp_render_params> full_size_params() const;
    Status check_whole_film() const;

    const BlockSource& source_;
    std::unique_ptr<ShardedBlocks> sharded_;  // with other processes: those of all
    uint64_t settled_host_limit_ = 0;         // then; else 0
    const BakedScene& scene_;
    const RenderOptions& options_;
    const RenderCallbacks& callbacks_;
    const RenderInstruments& instruments_;
    std::optional<Checkpointer> checkpointer_;
    SamplePool pool_{1};
    DeviceGroup devices_;  // refers to what stands above
    RenderRecorder recorder_;
    WorkDone earlier_;                   // by runs before this one, and by devices that have failed
    WorkDone outside_;                   // what the device did before a restart: not of this render
    std::vector<uint32_t> film_;         // if keeps_film(): what was taken from devices, or was there before
    std::vector<uint32_t> device_film_;  // that of one device, while it is taken
    FilmWindows windows_;                // if has_windows(): what is left in those that come next
    uint64_t texture_waits_before_ = 0;  // of devices that have failed, and in the end of other processes
    uint64_t begun_before_ = 0;          // samples: by runs before this one, or in another order, or by devices that have failed
    uint64_t sample_limit_ = 0;          // of numbers
    uint64_t samples_to_begin_ = 0;      // in all
    std::vector<SampleRange> left_out_;  // by a render that ends before its time
    // With other processes: numbers from common_begin_ on are taken by all, and common_taken_ of them were when this one last asked.
    uint64_t common_begin_ = 0, common_taken_ = 0, actions_ = 0;
    bool resumed_ = false;  // from a checkpoint, whichever process has read it
    bool said_idle_ = false, asked_to_stop_ = false, asked_to_stop_now_ = false, keeps_checkpoints_ = false;
    bool finished_ = false;  // all of them
    WorkDone of_peers_;
    uint64_t begun_by_peers_ = 0;
    double concurrent_of_peers_ = 0;  // seconds
    std::vector<RenderReport::DeviceWork> peer_devices_;
    std::vector<RenderReport::Rank> rank_figures_;  // of all
    Clock::time_point last_asked_, last_told_;
    std::optional<AdaptiveSampling> adaptive_;
    bool last_stage_ended_ = false;  // of adaptive sampling
    bool between_stages_ = false;    // an error has ended the render there: its film is of neither
    FirstPass first_pass_;           // coarse to fine
    bool in_first_pass_ = false;     // some of it have not begun
    uint64_t pixels_ = 0;
    uint32_t full_width_ = 0, full_height_ = 0;  // for as many pixels there is memory
    std::atomic<bool> cancelled_{false};
    bool late_ = false;                 // time is up: few samples begin any more
    std::optional<double> stop_began_;  // the same, because of a stop from outside
    bool shortened_ = false;            // by a stop, which takes samples from the picture
    bool stopped_ = false;              // here and now
    double snapshot_seconds_ = 0, snapshot_interval_ = 0;
    Clock::time_point start_ = Clock::now(), render_start_ = start_;
    double next_progress_ = 0, next_snapshot_ = 0, last_reported_ = 0;
    static constexpr double first_slow_check = 5;  // seconds of rendering
    double next_slow_check_ = first_slow_check;
    uint64_t last_rays_ = 0;
    double rate_ = 0;
};

}  // namespace raypager
