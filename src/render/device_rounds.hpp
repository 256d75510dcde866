// What one device does for a render: rounds of the wavefront, and the paging between them. Knows nothing of checkpoints, pictures or when to stop.
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>

#include "device/device.hpp"
#include "render/plan.hpp"
#include "residency/residency.hpp"
#include "store/block_source.hpp"
#include "wavefront/wavefront.hpp"

namespace raypager {

// A device among others.
struct DeviceShare : Sharers {
    std::string selector;                                   // of the device
    std::shared_ptr<DeviceHooks> hooks;                     // null: none
    bool order_is_given = false;                            // which another one has chosen
    uint32_t caches = 1;                                    // of blocks in main memory: one for each form that devices have them in
    std::vector<std::shared_ptr<HostCache>> shared_caches;  // those that others have made
};

class DeviceRounds {
public:
    // Makes everything on the device, within its limit. Where the driver refuses memory that other processes hold, it tries with less, and says so.
    // warn: a line for the user.
    static Result<std::unique_ptr<DeviceRounds>> create(const BlockSource& source, const RenderOptions& options, const RenderInstruments& instruments,
                                                        const rp_render_params& params, std::unique_ptr<Device> device, const DeviceShare& share,
                                                        const std::function<void(const std::string&)>& warn);

    // Without rounds under way: begins anew with another picture, of at most as many pixels. Blocks stay, and rounds are numbered on.
    Status restart(const rp_render_params& params);
    // Without rounds under way: hands over the device, for who makes others on it. Nothing else may be called afterwards.
    std::unique_ptr<Device> release_device();
    // False after an error that has left nothing on the device.
    bool usable() const { return wavefront_ && residency_; }

    // Rounds are numbered from 1.
    uint32_t started() const { return started_; }
    uint32_t ended() const { return ended_; }
    uint32_t under_way() const { return started_ - ended_; }
    bool may_start() const { return under_way() < (nothing_to_trace() || wavefront_->begins_again() ? 1 : plan_.rounds_under_way); }
    Status start();
    // Waits for the oldest round under way. Afterwards the counters are those of that round.
    Status finish();
    // After each: evicts blocks and starts loads by what rays wait for.
    Status page();
    // When no ray can go on and no round is under way. An error if no block is on its way.
    Status wait_for_block();

    const RoundCounters& counters() const { return counters_; }
    uint64_t texture_waits() const { return texture_waits_; }  // that have ended
    uint32_t slots() const { return plan_.params.slot_count; }
    uint32_t ready_rays() const { return counters_.extend_rays() + counters_.shadow_rays() + counters_.textured_slots(); }
    bool all_idle() const { return counters_.idle_slots() == slots(); }
    // Rays there are, but all wait for blocks; or none, and then the next round starts new paths or ends the render.
    bool nothing_to_trace() const { return ready_rays() == 0 && counters_.waiting_rays() > 0; }
    // Of paths under way, and those that are to begin again. REQUIRES: no round is under way.
    Status read_samples_under_way(std::vector<rp_path_sample>& samples);
    // How long the device ran nothing between two rounds while rays waited for blocks.
    double stall_seconds() const { return stall_seconds_; }

    const DeviceShare& share() const { return share_; }
    const RenderPlan& plan() const { return plan_; }
    Device& device() { return *device_; }
    const Device& device() const { return *device_; }
    Wavefront& wavefront() { return *wavefront_; }
    const Wavefront& wavefront() const { return *wavefront_; }
    Residency& residency() { return *residency_; }
    const Residency& residency() const { return *residency_; }

private:
    DeviceRounds(const BlockSource& source, const RenderOptions& options, const RenderInstruments& instruments, const DeviceShare& share,
                 std::unique_ptr<Device> device)
        : source_(source), options_(options), instruments_(instruments), share_(share), device_(std::move(device)) {}
    Status make(const rp_render_params& params, uint64_t memory_limit);
    void note_reduced_limit(const rp_render_params& params, const std::function<void(const std::string&)>& warn) const;
    void fill_by_waits();

    const BlockSource& source_;
    const RenderOptions& options_;
    const RenderInstruments& instruments_;
    const DeviceShare share_;
    std::unique_ptr<Device> device_;
    RenderPlan plan_;
    std::unique_ptr<Residency> residency_;
    std::unique_ptr<Wavefront> wavefront_;
    RoundCounters counters_;
    uint64_t texture_waits_ = 0;
    uint32_t started_ = 0, ended_ = 0;
    double stall_seconds_ = 0;
    // Host time in start, finish, page and wait_for_block since a round ended. It bounds the stall: a caller that pauses does not count.
    double attended_seconds_ = 0;
};

}  // namespace raypager
