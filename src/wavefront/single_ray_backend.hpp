// Rays traced one by one, a work-item each, over blocks in their stored form: for GPUs. On CPUs it does as on GPUs, so that it can be tested there.
#pragma once

#include <memory>

#include "wavefront/backend.hpp"
#include "wavefront/visit_log.hpp"

namespace raypager {

class SingleRayBackend : public Backend {
public:
    static Result<std::unique_ptr<Backend>> create(Device& device, const rp_render_params& params, const GeometryBuffers& geometry,
                                                   const WavefrontBuffers& buffers, const BackendSettings& settings, const VisitLogSettings& visits);
    // Its own buffers take at most so much; queues and slots are the wavefront's.
    static constexpr uint64_t bytes_per_slot = 1, fixed_bytes = sizeof(uint64_t);

    Status launch(const Round& round, StageEvents& events) override;
    Status wake_all_slots() override { return device_.kernels().fill_zero(sleep_groups_, 0, sleep_groups_.bytes()); }
    // One that found the log of visits full.
    bool leaves_untraced_camera_rays() const override { return visit_settings_.capacity > 0; }
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
    template <class... First>
    Status set_shading_arguments(const First&... first);
    uint32_t blocks_to_ask(const Round& round) const;
    Status set_arguments(Kernel& extend, const Round& round);

    VisitLogSettings visit_settings_;
    bool textures_ = false;
    uint32_t filled_together_ = 1;
    bool persistent_ = false;  // extension rays are traced by persistent threads
    Buffer sleep_groups_, visits_;
    Kernel publish_, wake_, generate_, advance_, extend_, extend_bounces_, shade_, connect_;
};

}  // namespace raypager
