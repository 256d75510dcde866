#include "render/device_worker.hpp"

#include <algorithm>

namespace raypager {

DeviceWorker::DeviceWorker(std::unique_ptr<DeviceRounds> rounds, SamplePool& pool, const RenderOptions& options, WorkerCallbacks callbacks,
                           bool several)
    : rounds_(std::move(rounds)), pool_(pool), options_(options), callbacks_(std::move(callbacks)), several_(several) {
    begin_anew();
    watch();
}

void DeviceWorker::begin_anew() {
    begun_last_ = rounds_->slots();
    begun_before_film_ = 0;
    film_round_ = rounds_->started();
    again_.clear();
}

Status DeviceWorker::restart(const rp_render_params& params) {
    RAYPAGER_TRY(rounds_->restart(params));
    begin_anew();
    return {};
}

DeviceWorker::~DeviceWorker() = default;

void DeviceWorker::watch() {
    watchdog_ = std::make_unique<Watchdog>(
        options_.stall_seconds, [this] { return rounds_->residency().loader_activity(); },
        [this](const std::string& text) { callbacks_.warn(text); });
    watchdog_->pause();
}

Result<bool> DeviceWorker::take_samples() {
    Wavefront& w = wavefront();
    if (!w.begins_again()) {
        std::vector<rp_path_sample> again = pool_.take_again();
        if (!again.empty()) {
            // Noted first: if the device fails in between, others are to begin them.
            if (several_) again_.insert(again_.end(), again.begin(), again.end());
            RAYPAGER_TRY(settle());
            RAYPAGER_TRY(w.wake_idle_slots());
            w.begin_with(std::move(again));
        }
    }
    // Enough for the rounds that are started before it is known how many this one has begun.
    const uint64_t soon = (Wavefront::max_rounds + 1) * begun_last_;
    while (!several_ || w.numbers().count() - w.samples_begun() <= soon) {
        const auto range = pool_.take();
        if (!range) break;
        w.numbers().append(*range);
        if (!w.may_have_idle_slots()) continue;
        RAYPAGER_TRY(settle());
        RAYPAGER_TRY(w.wake_idle_slots());
    }
    if (several_) w.expect_more(pool_.expects_more());
    const bool begins = w.begins_again() || w.numbers().count() > w.samples_begun();
    if (!several_ || begins || rounds_->ready_rays() > 0 || rounds_->counters().waiting_rays() > 0) return true;
    RAYPAGER_TRY(settle());  // rounds under way have nothing to do either
    return false;
}

Status DeviceWorker::round() {
    while (rounds_->may_start()) RAYPAGER_TRY(rounds_->start());
    RAYPAGER_TRY(finish_round());
    RAYPAGER_TRY(rounds_->page());
    watchdog_->round_ended(make_round_state(rounds_->ended(), rounds_->counters(), rounds_->residency()));
    if ((!rounds_->nothing_to_trace() && !options_.tuning.wait_for_loads) || rounds_->under_way() > 0) return {};
    watchdog_->doing("waiting for a block");
    return rounds_->wait_for_block();
}

Status DeviceWorker::finish_round() {
    watchdog_->doing("tracing");
    const uint64_t before = wavefront().samples_begun();
    RAYPAGER_TRY(rounds_->finish());
    begun_last_ = wavefront().samples_begun() - before;
    return callbacks_.round_ended ? callbacks_.round_ended() : Status();
}

Status DeviceWorker::settle() {
    while (rounds_->under_way() > 0) RAYPAGER_TRY(finish_round());
    return {};
}

Status DeviceWorker::take_arrivals() { return rounds_->residency().take_arrivals_between(rounds_->started()); }

void DeviceWorker::film_was_taken(std::vector<rp_path_sample> under_way) {
    begun_before_film_ = wavefront().samples_begun();
    film_round_ = rounds_->started();
    again_ = std::move(under_way);
}

WorkerFigures DeviceWorker::figures() const {
    WorkerFigures f;
    f.index = rounds_->device().info().index;
    f.counters = rounds_->counters();
    f.paging = rounds_->residency().statistics();
    f.begun = wavefront().samples_begun();
    f.again_left = wavefront().again_left();
    f.slots = rounds_->slots();
    f.ready_rays = rounds_->ready_rays();
    f.rounds = rounds_->ended();
    f.resident_bytes = rounds_->residency().resident_bytes();
    f.pool_bytes = rounds_->residency().pool_bytes();
    f.texture_waits = rounds_->texture_waits();
    f.begins_again = wavefront().begins_again();
    f.all_idle = rounds_->all_idle();
    WorkDone& work = f.work;
    work.stall_seconds = rounds_->stall_seconds();
    for (size_t i = 0; i < std::size(work.stage_seconds); i++) work.stage_seconds[i] = static_cast<double>(wavefront().stage_nanoseconds()[i]) * 1e-9;
    work.camera_rays = f.counters.camera_rays();
    work.bounce_rays = f.counters.bounce_rays();
    work.shadow_rays = f.counters.total_shadow_rays();
    work.loads = f.paging.loads;
    work.evictions = f.paging.evictions;
    work.bytes_loaded = f.paging.bytes_loaded;
    work.rounds = f.rounds;
    work.requests_without_hit = f.counters.requests_without_hit();
    return f;
}

void DeviceWorker::take_rounds(std::unique_ptr<DeviceRounds> rounds) {
    rounds_ = std::move(rounds);
    begin_anew();
    watch();
}

std::vector<SampleRange> DeviceWorker::ranges_since_film() const {
    return usable() ? wavefront().numbers().from(begun_before_film_) : std::vector<SampleRange>();
}

std::unique_ptr<Device> DeviceWorker::release_device() {
    watchdog_.reset();
    return rounds_->release_device();
}

}  // namespace raypager
