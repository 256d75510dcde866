// How far a render is, while it goes on: with several processes, all of them.
#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "base/words.hpp"
#include "render/expected_waits.hpp"
#include "render/job.hpp"
#include "render/value_bytes.hpp"

namespace raypager {
namespace {

// What a process tells rank 0, in front of the figures of its devices.
struct Told {
    int64_t begun;
    WorkDone work;
};

}  // namespace

// Samples, without those that are to be begun again. Of several processes rank 0 counts those that a checkpoint has left under way; another that
// begins some of them again has less than none at first.
int64_t RenderJob::begun_here(const std::vector<WorkerFigures>& devices) const {
    uint64_t begun = samples_begun() - first_pass_.left() - pool_.again().size() - windows_.again().size();
    for (const WorkerFigures& f : devices) begun -= f.again_left;
    return static_cast<int64_t>(begun);
}

Status RenderJob::tell_progress() {
    if (options_.peers->rank() == 0) return {};
    const std::vector<WorkerFigures> devices = devices_.figures();
    std::vector<std::byte> bytes;
    put_values(bytes, std::vector{Told{begun_here(devices), work()}});
    put_values(bytes, devices);
    last_told_ = Clock::now();
    return options_.peers->tell(std::move(bytes));
}

RenderJob::Standing RenderJob::standing() const {
    Standing all;
    all.work = work();
    all.devices.push_back(devices_.figures());
    all.begun = begun_here(all.devices.front());
    if (!options_.peers) return all;
    const std::vector<std::vector<std::byte>> told = options_.peers->told();
    for (size_t rank = 1; rank < told.size() && options_.peers->rank() == 0; rank++) {
        all.devices.emplace_back();
        if (told[rank].empty()) continue;
        std::span<const std::byte> rest(told[rank]);
        const Told of_rank = take_values<Told>(rest)[0];
        all.begun += of_rank.begun;
        all.work += without_clock(of_rank.work);
        all.devices.back() = take_values<WorkerFigures>(rest);
    }
    return all;
}

RenderProgress RenderJob::progress() const { return progress_at(standing()); }

RenderProgress RenderJob::progress_at(const Standing& all) const {
    RenderProgress p;
    p.seconds = all.work.render_seconds;
    p.snapshot_seconds = snapshot_seconds_;
    uint64_t under_way = 0;
    const uint32_t first_rank = options_.peers ? options_.peers->rank() : 0;  // all others know of themselves alone
    for (size_t rank = 0; rank < all.devices.size(); rank++)
        for (const WorkerFigures& f : all.devices[rank]) {
            under_way += uint64_t{f.ready_rays} + f.counters.waiting_rays();
            p.resident_bytes += f.resident_bytes;
            p.pool_bytes += f.pool_bytes;
            p.devices.push_back({first_rank + static_cast<uint32_t>(rank), f.index, f.work.camera_rays,
                                 f.work.camera_rays + f.work.bounce_rays + f.work.shadow_rays, f.work.bytes_loaded, f.resident_bytes});
        }
    auto begun = static_cast<uint64_t>(std::max<int64_t>(0, all.begun));
    // What others have taken is as good as begun.
    if (first_rank > 0) begun = std::max(begun, common_begin_ + std::min(common_taken_, common_end()));
    p.spp = static_cast<double>(begun) / static_cast<double>(pixels_);
    p.finished_spp = static_cast<double>(begun - std::min(begun, under_way)) / static_cast<double>(pixels_);
    const uint64_t most = adaptive_ ? pixels_ * wavefront().params().spp : samples_to_begin_;
    const double by_samples = last_stage_ended_ ? 1 : static_cast<double>(begun) / static_cast<double>(most);
    const double by_time = options_.time_seconds > 0 ? p.seconds / (earlier_.render_seconds + options_.time_seconds) : 0;
    p.fraction = std::min(1.0, std::max(by_samples, by_time));
    p.rays = all.work.camera_rays + all.work.bounce_rays + all.work.shadow_rays;
    p.rays_per_second = rate_;
    p.loads = all.work.loads;
    p.bytes_loaded = all.work.bytes_loaded;
    p.geometry_bytes = scene_.memory_bytes(first().rounds().plan().form);
    return p;
}

// Once, by limits or by what has been seen.
void RenderJob::warn_that_it_crawls(const std::string& why) {
    next_slow_check_ = std::numeric_limits<double>::infinity();
    warn(why +
         "; a larger --memory-limit or --geometry-limit, or more --paths, would make the render many times as fast; 'raypager plan' says what limits "
         "cost");
}

// At the start, by the limits alone.
void RenderJob::warn_of_waits() {
    if ((options_.peers && options_.peers->rank() > 0) || options_.time_seconds > 0 || options_.tuning.pool_place == PoolPlace::host) return;
    const DeviceRounds& rounds = first().rounds();
    const DeviceInfo& device = rounds.device().info();
    const double geometry = static_cast<double>(scene_.memory_bytes(rounds.plan().form));
    WaitNeeds needs;
    needs.paths = samples_to_begin_ - std::min(samples_to_begin_, begun_before_);
    needs.slots = uint64_t{rounds.slots()} * devices_.count() * (options_.peers ? options_.peers->count() : 1);
    needs.blocks = scene_.pageable_count();
    needs.resident_share = geometry > 0 ? static_cast<double>(rounds.residency().pool_bytes()) / geometry : 1;
    needs.max_depth = wavefront().params().max_depth;
    needs.rays_per_second = device.compute_units * device.profile.expected_rays;
    needs.loads_per_second = device.profile.expected_loads;
    needs.sweeps = options_.tuning.policy == PolicyKind::sweep;
    const ExpectedSeconds expected = expected_seconds(needs);
    if (!crawls(expected)) return;
    warn_that_it_crawls(fmt::format(
        "with {} and {:.1f} % of the scene resident, rays are expected to wait for blocks for some {:.0f} s, where tracing takes {:.1f} s",
        counted(needs.slots, "path slot"), 100 * std::min(1.0, needs.resident_share), expected.waiting, expected.tracing));
}

// Once, where waiting for blocks makes a render more than ten times as long as its kernels take. First loads, which every render has, do not count.
void RenderJob::warn_if_slow(double now) {
    if (now < next_slow_check_ || (options_.peers && options_.peers->rank() > 0)) return;
    next_slow_check_ *= 2;
    double stall = -outside_.stall_seconds, kernels = 0, devices = 0;
    uint64_t loads = 0, evictions = 0;
    for (const std::vector<WorkerFigures>& of_rank : standing().devices)
        for (const WorkerFigures& f : of_rank) {
            stall += f.work.stall_seconds;
            for (const double seconds : f.work.stage_seconds) kernels += seconds;
            loads += f.work.loads;
            evictions += f.work.evictions;
            devices++;
        }
    loads -= outside_.loads;
    evictions -= outside_.evictions;
    if (10 * kernels > devices * now || stall < devices * now / 2 || 2 * evictions <= loads) return;
    warn_that_it_crawls(fmt::format("rays wait for blocks: the device has worked for {:.1f} of {:.1f} s", kernels / devices, now));
}

Status RenderJob::report_progress() {
    const double now = render_seconds();
    warn_if_slow(now);
    if (callbacks_.progress && now >= next_progress_) {
        next_progress_ = now + options_.progress_seconds;
        const Standing all = standing();
        const uint64_t rays =
            all.work.camera_rays + all.work.bounce_rays + all.work.shadow_rays - earlier_.camera_rays - earlier_.bounce_rays - earlier_.shadow_rays;
        if (now > last_reported_) rate_ = static_cast<double>(rays - std::min(rays, last_rays_)) / (now - last_reported_);
        last_reported_ = now;
        last_rays_ = rays;
        callbacks_.progress(progress_at(all));
    }
    return callbacks_.snapshot && !options_.peers && options_.snapshot_seconds > 0 && now >= next_snapshot_ ? snapshot(now) : Status();
}

}  // namespace raypager
