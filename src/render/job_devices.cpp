// Which devices a render has: making them, and going on without those that fail.
#include <fmt/format.h>

#include <algorithm>
#include <future>

#include "base/words.hpp"
#include "device/select.hpp"
#include "render/job.hpp"
#include "render/params.hpp"

namespace raypager {

// What only one device can do.
Status RenderJob::check_several() const {
    if (instruments_.record_paths > 0 || instruments_.keep_journal)
        return Status::usage("a render on several devices cannot be recorded; name one with --device");
    if (options_.tuning.pool_place == PoolPlace::host) return Status::usage("--pool host: is for one device; name it with --device");
    return {};
}

Result<std::unique_ptr<DeviceRounds>> RenderJob::make_rounds(const rp_render_params& params, const DeviceShare& share) {
    auto device = Device::open(share.selector, options_.memory_limit, options_.tuning.profile, share.hooks);
    if (!device) return device.status();
    // Devices that share the memory of the machine share what is taken of it by default, too.
    if (share.devices > 1 && options_.memory_limit == 0 && (*device)->profile().shares_host_memory) {
        const uint64_t part = (*device)->default_limit().bytes / share.devices;
        device = Device::open(share.selector, part, options_.tuning.profile, share.hooks);
        if (!device) return device.status();
    }
    RAYPAGER_TRY(check_picture_size(params, (*device)->info()));
    return DeviceRounds::create(source_, options_, instruments_, params, std::move(*device), share, [this](const std::string& text) { warn(text); });
}

// The first one, which decides about the order of samples and has the cache of blocks; then the others, side by side. What fails is left out, as long
// as there is another one.
Status RenderJob::make_devices(rp_render_params& params) {
    const std::shared_ptr<DeviceHooks> hooks = instruments_.device_hooks ? instruments_.device_hooks : std::make_shared<DeviceHooks>();
    auto choice = choose_devices(options_.device, options_.allow_different, *hooks);
    if (!choice) return choice.status();
    if (!choice->note.empty()) warn(choice->note);
    const size_t count = choice->selectors.size();
    if (count > 1) RAYPAGER_TRY(check_several());
    const auto hooks_of = [&](size_t i) {
        const auto& more = instruments_.more_device_hooks;
        return i == 0 ? instruments_.device_hooks : i <= more.size() ? more[i - 1] : nullptr;
    };
    std::vector<DeviceShare> shares;
    for (size_t i = 0; i < count; i++) shares.push_back({choice->selectors[i], hooks_of(i), static_cast<uint32_t>(count), nullptr});

    auto named = select_device(shares[0].selector, *hooks);
    if (!named) return named.status();
    const DeviceInfo& info = named->info;
    RAYPAGER_TRY(check_picture_size(params, info));
    // It takes some milliseconds, which short renders would notice.
    const RenderIdentity identity = options_.checkpoint.file.empty() ? RenderIdentity() : identity_of(scene_, params);
    auto checkpointer = Checkpointer::create(options_.checkpoint, identity, params.spp, params.order, info.name + ", " + info.driver);
    if (!checkpointer) return checkpointer.status();
    checkpointer_ = std::move(*checkpointer);
    if (checkpointer_->other_device()) warn("the checkpoint was written on another device or driver: the last bits of the picture may differ");
    params.order = checkpointer_->order();

    std::vector<Result<std::unique_ptr<DeviceRounds>>> made;
    made.reserve(count);
    std::shared_ptr<HostCache> cache;
    for (size_t i = 0; i < count && !cache; i++) {
        made.push_back(make_rounds(params, shares[i]));
        if (!made.back()) continue;
        cache = (*made.back())->residency().cache();
        params.order = (*made.back())->plan().params.order;
    }
    std::vector<std::future<Result<std::unique_ptr<DeviceRounds>>>> others;
    for (size_t i = made.size(); i < count; i++) {
        shares[i].cache = cache;
        others.push_back(std::async(std::launch::async, [this, &params, &share = shares[i]] { return make_rounds(params, share); }));
    }
    for (auto& other : others) made.push_back(other.get());
    if (!cache) return made.front().status();

    const auto alive = static_cast<uint32_t>(std::count_if(made.begin(), made.end(), [](const auto& rounds) { return rounds.ok(); }));
    pool_.set_devices(alive);
    std::vector<std::unique_ptr<DeviceWorker>> workers;
    for (size_t i = 0; i < count; i++) {
        if (!made[i]) {
            warn(fmt::format("device {}: {}; the render goes on without it", shares[i].selector, made[i].status().message()));
            continue;
        }
        WorkerCallbacks callbacks = {[this](const std::string& text) { warn(text); }, {}};
        if (alive == 1) callbacks.round_ended = [this] { return recorder_.round_ended(wavefront(), render_seconds() - snapshot_seconds_); };
        workers.push_back(std::make_unique<DeviceWorker>(std::move(*made[i]), pool_, options_, std::move(callbacks), alive > 1));
    }
    devices_.begin(std::move(workers), pool_);
    return {};
}

// What it has done since its film was last taken is lost with it, and done again by others.
void RenderJob::drop(const DeviceGroup::Failure& failure) {
    DeviceWorker& worker = *failure.worker;
    const DeviceInfo& info = worker.rounds().device().info();
    warn(fmt::format("device {} ({}): {}; {} going on without it", info.index, info.name, failure.error.message(),
                     devices_.count() == 2 ? "the other one is" : "the others are"));
    earlier_ += worker.figures().work;
    begun_before_ += worker.begun_before_film();
    pool_.set_devices(static_cast<uint32_t>(devices_.count() - 1));
    std::vector<SampleRange> ranges = worker.ranges_since_film();
    std::vector<rp_path_sample> again = worker.again_since_film();
    devices_.drop(worker);
    pool_.add(std::move(ranges));
    pool_.add_again(again);
}

// An error that is none of the device's own would meet the others, too.
Status RenderJob::drop_failed() {
    for (;;) {
        const DeviceGroup::Failure failure = devices_.failed();
        if (!failure.worker) return {};
        if (failure.error.kind() != ErrorKind::device || devices_.count() == 1) return failure.error;
        drop(failure);
    }
}

}  // namespace raypager
