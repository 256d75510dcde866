#include "render/device_rounds.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "base/words.hpp"
#include "render/watchdog.hpp"

namespace raypager {
namespace {

class AddTime {
public:
    explicit AddTime(double& seconds) : seconds_(seconds) {}
    ~AddTime() { seconds_ += std::chrono::duration<double>(Clock::now() - begin_).count(); }
    AddTime(const AddTime&) = delete;
    AddTime& operator=(const AddTime&) = delete;

private:
    using Clock = std::chrono::steady_clock;
    double& seconds_;
    const Clock::time_point begin_ = Clock::now();
};

}  // namespace

Result<std::unique_ptr<DeviceRounds>> DeviceRounds::create(const BlockSource& source, const RenderOptions& options,
                                                           const RenderInstruments& instruments, const rp_render_params& params,
                                                           std::unique_ptr<Device> device, const DeviceShare& share,
                                                           const std::function<void(const std::string&)>& warn) {
    std::unique_ptr<DeviceRounds> rounds(new DeviceRounds(source, options, instruments, share, std::move(device)));
    Status made = rounds->make(params, rounds->device_->budget().limit());
    // Another process may hold memory that the driver counts as ours: then with less, until the least that would do is refused, too.
    uint64_t refused = 0;
    while (!made && rounds->device_ && rounds->device_->refused_memory()) {
        refused = rounds->plan_.device_bytes;
        const uint64_t less = refused / 8 * 7;
        warn(fmt::format("{}; trying with {} of device memory", made.message(), format_bytes(less)));
        made = rounds->make(params, less);
    }
    if (!made && refused > 0) return Status::failed(fmt::format("the device refused {}; with less, {}", format_bytes(refused), made.message()));
    RAYPAGER_TRY(made);
    rounds->note_reduced_limit(params, warn);
    return rounds;
}

Status DeviceRounds::make(const rp_render_params& params, uint64_t memory_limit) {
    wavefront_.reset();
    residency_.reset();
    if (device_->budget().limit() != memory_limit) {
        device_.reset();
        auto device = Device::open(share_.selector, memory_limit, options_.tuning.profile, share_.hooks);
        if (!device) return device.status();
        device_ = std::move(*device);
    }
    const BakedScene& scene = source_.scene();
    auto plan = plan_render(scene, options_, instruments_, params, device_->info(), memory_limit, share_);
    if (!plan) return plan.status();
    plan_ = *plan;
    if (share_.order_is_given) plan_.params.order = params.order;
    plan_.residency.host_limit -= std::min(plan_.residency.host_limit, source_.held_bytes());
    plan_.residency.host_limit /= share_.caches;
    std::shared_ptr<HostCache> cache;
    for (const std::shared_ptr<HostCache>& shared : share_.shared_caches)
        if (shared->form() == plan_.form) cache = shared;
    if (!cache) cache = Residency::make_cache(*device_, source_, plan_.residency, share_.devices);
    auto residency = Residency::create(*device_, std::move(cache), plan_.residency);
    if (!residency) return residency.status();
    residency_ = std::move(*residency);
    auto wavefront = Wavefront::create(*device_, scene, plan_.form, plan_.params, residency_->slabs(), residency_->page_table(),
                                       plan_.filled_together, plan_.notes, plan_.visits);
    if (!wavefront) return wavefront.status();
    wavefront_ = std::move(*wavefront);
    return {};
}

Status DeviceRounds::restart(const rp_render_params& params) {
    wavefront_.reset();
    const uint32_t slots = plan_.params.slot_count;
    plan_.params = params;
    plan_.params.slot_count = slots;
    residency_->forget_demand();
    counters_ = {};
    texture_waits_ = 0;
    auto wavefront = Wavefront::create(*device_, source_.scene(), plan_.form, plan_.params, residency_->slabs(), residency_->page_table(),
                                       plan_.filled_together, plan_.notes, plan_.visits);
    if (!wavefront) return wavefront.status();
    wavefront_ = std::move(*wavefront);
    return {};
}

std::unique_ptr<Device> DeviceRounds::release_device() {
    wavefront_.reset();
    residency_.reset();
    return std::move(device_);
}

// The default limit is the same every time, unless less memory is free; who compares two renders should know, if that made a difference.
void DeviceRounds::note_reduced_limit(const rp_render_params& params, const std::function<void(const std::string&)>& warn) const {
    const DefaultLimit& limit = device_->default_limit();
    if (options_.memory_limit || share_.devices > 1 || !limit.reduced()) return;
    const auto usual = plan_render(source_.scene(), options_, instruments_, params, device_->info(), limit.usual, share_);
    if (!usual || (usual->params.slot_count == slots() && usual->residency.pool_bytes == residency_->pool_bytes())) return;
    warn(fmt::format("other programs hold much of the memory: the memory limit is {} instead of {}; --memory-limit sets another",
                     format_bytes(device_->budget().limit()), format_bytes(limit.usual)));
}

Status DeviceRounds::start() {
    const AddTime timer(attended_seconds_);
    if (++started_ == RP_NONE) return Status::failed("too many rounds: the counters of blocks end at 2^32 - 2; go on with more --paths");
    RAYPAGER_TRY(residency_->publish(device_->kernels()));
    return wavefront_->start_round(started_, residency_->page_changes(), residency_->newly_published());
}

Status DeviceRounds::finish() {
    ended_++;
    std::span<const rp_block_demand> demand;
    {
        const AddTime timer(attended_seconds_);
        RAYPAGER_TRY(wavefront_->finish_round(counters_, demand));
    }
    if (counters_.waiting_rays() > 0) stall_seconds_ += std::min(attended_seconds_, static_cast<double>(wavefront_->idle_nanoseconds()) * 1e-9);
    attended_seconds_ = 0;
    residency_->take_demand(ended_, demand);
    texture_waits_ += counters_.textured_slots();
    fill_by_waits();
    return {};
}

// Path slots are gigabytes on a large device, so they are not read in vain at the end.
Status DeviceRounds::read_samples_under_way(std::vector<rp_path_sample>& samples) {
    if (ready_rays() > 0 || counters_.waiting_rays() > 0) return wavefront_->read_samples_under_way(samples);
    samples = wavefront_->samples_again_left();
    return {};
}

// A ray that waits keeps the slots that were filled with it from being used. Extension rays stand for all.
void DeviceRounds::fill_by_waits() {
    if (!plan_.fills_by_waits) return;
    const uint64_t rays = counters_.camera_rays() + counters_.bounce_rays();
    if (rays < slots()) return;  // too few to tell
    wavefront_->fill_together(filled_together(static_cast<double>(counters_.requests_served()) / static_cast<double>(rays)));
}

Status DeviceRounds::page() {
    const AddTime timer(attended_seconds_);
    return residency_->after_round(ended_, started_, wavefront_->last_round_end(), ready_rays(), slots());
}

Status DeviceRounds::wait_for_block() {
    const AddTime timer(attended_seconds_);
    auto arrived = residency_->wait_for_block(ended_);
    if (!arrived) return arrived.status();
    if (*arrived || !nothing_to_trace()) return {};
    return Status::failed(fmt::format("no progress in round {}: rays wait for blocks, but none is on its way: {}; this is a bug", ended_,
                                      describe(make_round_state(ended_, counters_, *residency_))));
}

}  // namespace raypager
