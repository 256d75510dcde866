// Rays traced one by one, a work-item each, over blocks in their stored form: for GPUs. On CPUs it does as on GPUs, so that it can be tested there.
#pragma once

#include <memory>

#include "wavefront/backend.hpp"

namespace raypager {

// What is recorded of the blocks that rays enter (abi/visits.h). By default nothing, and then it costs nothing.
struct VisitLogSettings {
    uint32_t capacity = 0;   // events a round; rays that find no room wait for the next one. 0: nothing is recorded
    uint32_t threshold = 0;  // RP_VISIT_THRESHOLD: 2^32 - 1 records all paths
    uint64_t bytes() const;  // on the device
};

class SingleRayBackend : public Backend {
public:
    static Result<std::unique_ptr<Backend>> create(Device& device, const rp_render_params& params, const GeometryBuffers& geometry,
                                                   const WavefrontBuffers& buffers, const BackendSettings& settings, const VisitLogSettings& visits);
    // Its own buffers, per slot; queues and slots are the wavefront's.
    static constexpr uint64_t bytes_per_slot = 1;

    Status launch(const Round& round, StageEvents& events) override;
    SlotForm slot_form() const override { return SlotForm::single_rays; }
    // What is recorded stays in the order of the stages.
    bool connects_concurrently() const override { return visit_settings_.capacity == 0; }
    void fill_together(uint32_t slots) override;
    Status read_visits(std::vector<uint32_t>& words) override;

private:
    using Backend::Backend;
    Status allocate();
    Status build(const BackendSettings& settings);
    Status change_pages(std::span<const rp_page> changes);
    Status set_tracing_arguments(Kernel& extend, uint32_t round);
    Status set_arguments(Kernel& extend, const Round& round);

    VisitLogSettings visit_settings_;
    bool count_bounces_ = false;
    uint32_t filled_together_ = 1;
    bool persistent_ = false;  // extension rays are traced by persistent threads
    Buffer naps_, visits_;
    Kernel publish_, wake_, generate_, advance_, extend_, extend_bounces_, shade_, connect_;
};

}  // namespace raypager
