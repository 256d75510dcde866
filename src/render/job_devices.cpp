// Which devices a render has: making them, and going on without those that fail.
#include <fmt/format.h>

#include <algorithm>
#include <future>
#include <set>

#include "base/words.hpp"
#include "device/select.hpp"
#include "render/job.hpp"
#include "render/params.hpp"
#include "wavefront/block_form.hpp"

namespace raypager {

// What only one device can do.
Status RenderJob::check_several() const {
    if (instruments_.record_paths > 0 || instruments_.keep_journal || instruments_.parts)
        return Status::usage("a render on several devices cannot be recorded; name one with --device");
    if (options_.tuning.pool_place == PoolPlace::host) return Status::usage("--pool host: is for one device; name it with --device");
    return {};
}

Result<std::unique_ptr<Device>> RenderJob::open_device(const DeviceShare& share) const {
    auto device = Device::open(share.selector, options_.memory_limit, options_.tuning.profile, share.hooks);
    if (!device) return device.status();
    // Devices that share the memory of the machine share what is taken of it by default, too.
    if (share.devices > 1 && options_.memory_limit == 0 && (*device)->profile().shares_host_memory) {
        const uint64_t part = (*device)->default_limit().bytes / share.devices;
        device = Device::open(share.selector, part, options_.tuning.profile, share.hooks);
    }
    return device;
}

Result<std::unique_ptr<DeviceRounds>> RenderJob::make_rounds(const rp_render_params& params, const DeviceShare& share,
                                                             Result<std::unique_ptr<Device>> device) {
    if (!device) return device.status();
    RAYPAGER_TRY(check_picture_size(params, (*device)->info(), may_take_windows(options_, instruments_, params, share)));
    return DeviceRounds::create(blocks_from(), options_, instruments_, params, std::move(*device), share,
                                [this](const std::string& text) { warn(text); });
}

Result<std::vector<DeviceShare>> RenderJob::choose_shares(DeviceInfo& first) const {
    const std::shared_ptr<DeviceHooks> hooks = instruments_.device_hooks ? instruments_.device_hooks : std::make_shared<DeviceHooks>();
    const auto choice = choose_devices(options_.device, options_.allow_different, *hooks);
    if (!choice) return choice.status();
    if (!choice->note.empty()) warn(choice->note);
    const auto count = static_cast<uint32_t>(choice->selectors.size());
    if (count > 1) RAYPAGER_TRY(check_several());
    const Peers* peers = options_.peers.get();
    std::vector<DeviceShare> shares;
    std::set<BlockForm> forms;
    for (uint32_t i = 0; i < count; i++) {
        const auto named = select_device(choice->selectors[i], *hooks);
        if (!named) return named.status();
        if (i == 0) first = named->info;
        forms.insert(block_form(options_.tuning.traversal, named->info, scene_.instance_levels()));
        DeviceShare& share = shares.emplace_back();
        share.selector = choice->selectors[i];
        const auto& more = instruments_.more_device_hooks;
        share.hooks = i == 0 ? instruments_.device_hooks : i <= more.size() ? more[i - 1] : nullptr;
        share.processes = peers ? peers->local_count() : 1;
        share.devices = count * share.processes;
        share.all_devices = count * (peers ? peers->count() : 1);
    }
    for (DeviceShare& share : shares) share.caches = static_cast<uint32_t>(forms.size());
    return shares;
}

// Of several processes, rank 0 has it.
Status RenderJob::open_checkpoint(rp_render_params& params, const DeviceInfo& device) {
    const bool keeps = !options_.checkpoint.file.empty() && (!options_.peers || options_.peers->rank() == 0);
    // It takes some milliseconds, which short renders would notice.
    const RenderIdentity identity = keeps ? identity_of(scene_, params) : RenderIdentity();
    auto checkpointer = Checkpointer::create(keeps ? options_.checkpoint : CheckpointOptions(), identity, params.spp, params.order,
                                             device.name + ", " + device.driver);
    if (!checkpointer) return checkpointer.status();
    checkpointer_ = std::move(*checkpointer);
    if (checkpointer_->other_device()) warn("the checkpoint was written on another device or driver: the last bits of the picture may differ");
    params.order = checkpointer_->order();
    resumed_ = checkpointer_->resumed();
    return {};
}

// The first one, which decides about the order of samples and has the cache of blocks; then the others, side by side unless they need another cache.
std::vector<Result<std::unique_ptr<DeviceRounds>>> RenderJob::make_all_rounds(rp_render_params& params, std::vector<DeviceShare>& shares) {
    std::vector<Result<std::unique_ptr<DeviceRounds>>> made;
    made.reserve(shares.size());
    bool any = false;
    std::vector<std::future<Result<std::unique_ptr<DeviceRounds>>>> others;
    std::vector<std::shared_ptr<HostCache>> caches;
    // A driver takes a quarter of a second for each.
    std::vector<std::future<Result<std::unique_ptr<Device>>>> opened;
    const auto how = shares.size() > 1 ? std::launch::async : std::launch::deferred;
    for (const DeviceShare& share : shares) opened.push_back(std::async(how, [this, &share] { return open_device(share); }));
    for (size_t i = 0; i < shares.size(); i++) {
        DeviceShare& share = shares[i];
        share.order_is_given = any || (options_.peers && options_.peers->rank() > 0);
        share.shared_caches = caches;
        if (any && share.caches == 1) {
            others.push_back(std::async(std::launch::async, [this, &params, &share, device = std::move(opened[i])]() mutable {
                return make_rounds(params, share, device.get());
            }));
            continue;
        }
        made.push_back(make_rounds(params, share, opened[i].get()));
        if (!made.back()) continue;
        const DeviceRounds& rounds = **made.back();
        if (!any) params.order = rounds.plan().params.order;
        any = true;
        caches.push_back(rounds.residency().cache());
    }
    for (auto& other : others) made.push_back(other.get());
    return made;
}

// What fails is left out, as long as there is another one.
Status RenderJob::make_devices(rp_render_params& params) {
    DeviceInfo info;
    auto shares = choose_shares(info);
    if (!shares) return shares.status();
    RAYPAGER_TRY(check_picture_size(params, info, may_take_windows(options_, instruments_, params, shares->front())));
    RAYPAGER_TRY(open_checkpoint(params, info));
    RAYPAGER_TRY(share_blocks(info));
    for (DeviceShare& share : *shares) share.host_limit = settled_host_limit_;
    const bool leads = !options_.peers || options_.peers->rank() == 0;
    if (!leads) RAYPAGER_TRY(begin_with_peers(params, info));
    auto made = make_all_rounds(params, *shares);
    const auto alive = static_cast<uint32_t>(std::count_if(made.begin(), made.end(), [](const auto& rounds) { return rounds.ok(); }));
    if (alive == 0) return made.front().status();
    if (leads) RAYPAGER_TRY(begin_with_peers(params, info));

    const bool shared = alive > 1 || options_.peers;
    pool_.set_devices(alive);
    std::vector<std::unique_ptr<DeviceWorker>> workers;
    for (size_t i = 0; i < made.size(); i++) {
        if (!made[i]) {
            warn(fmt::format("device {}: {}; the render goes on without it", (*shares)[i].selector, made[i].status().message()));
            continue;
        }
        WorkerCallbacks callbacks = {[this](const std::string& text) { warn(text); }, {}};
        if (!shared) callbacks.round_ended = [this] { return recorder_.round_ended(wavefront(), render_seconds() - snapshot_seconds_); };
        workers.push_back(std::make_unique<DeviceWorker>(std::move(*made[i]), pool_, options_, std::move(callbacks), shared));
    }
    devices_.begin(std::move(workers), pool_, shared);
    return {};
}

// What it has done since its film was last taken is lost with it, and done again by others.
void RenderJob::drop(const DeviceGroup::Failure& failure) {
    DeviceWorker& worker = *failure.worker;
    warn(fmt::format("device {}: {}; {} going on without it", worker.rounds().share().selector, failure.error.message(),
                     devices_.count() == 2 ? "the other one is" : "the others are"));
    earlier_ += failure.figures.work;
    texture_waits_before_ += failure.figures.texture_waits;
    begun_before_ += worker.begun_before_film();
    pool_.set_devices(static_cast<uint32_t>(devices_.count() - 1));
    std::vector<SampleRange> ranges = worker.ranges_since_film();
    std::vector<rp_path_sample> again = worker.again_since_film();
    devices_.drop(worker);
    pool_.add(std::move(ranges));
    pool_.add_again(again);
}

Status RenderJob::on_each_device(const std::function<Status(DeviceWorker&)>& act) {
    for (size_t i = 0; i < devices_.count();) {
        DeviceWorker& worker = devices_.worker(i);
        const Status status = act(worker);
        if (status) {
            i++;
            continue;
        }
        if (!devices_.several()) return status;
        devices_.fail(worker, status);
        RAYPAGER_TRY(drop_failed());
    }
    return {};
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
