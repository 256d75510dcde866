// The engine's own tracing stages, `extend` and `connect`, on rays that are put into path slots; the whole scene is resident.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "bench/ray_sets.hpp"
#include "device/device.hpp"
#include "raypager/status.hpp"
#include "residency/residency.hpp"
#include "store/block_file.hpp"
#include "wavefront/block_form.hpp"
#include "wavefront/geometry_buffers.hpp"
#include "wavefront/path_state.hpp"

namespace raypager::bench {

// surfaces: camera rays or bounces that are traced to learn where they end; a render leaves that to another stage on some devices.
enum class RayPurpose { camera, bounce, shadow, surfaces };

class StageTracer {
public:
    // device, memory_limit and tuning as in RenderOptions. max_rays: of one set.
    static Result<std::unique_ptr<StageTracer>> create(const BlockFile& file, const std::string& device, uint64_t memory_limit,
                                                       const ProfileChanges& tuning, Traversal traversal, uint64_t max_rays);
    const Device& device() const { return *device_; }
    BlockForm form() const { return form_; }

    // Puts rays into the slots: ray i into slot i.
    Status fill(const std::vector<Ray>& rays, RayPurpose purpose);
    // Traces what was put there last; returns seconds on the device. Each filling can be traced once, unless keep() follows it: then as often as
    // again() comes before, which puts back on the device what was kept there.
    Result<double> trace();
    Status keep();
    Status again();
    // What the rays hit. REQUIRES: they were traced for their surfaces.
    Status hits(std::vector<SurfacePoint>& hits);
    // Distances at which extension rays ended, as far as they hit something; otherwise as far as they may go.
    Status distances(std::vector<float>& distances);
    // Which shadow rays were blocked.
    Status blocked(std::vector<bool>& blocked);

private:
    StageTracer() = default;
    Status make_slots(uint32_t count);

    std::unique_ptr<Device> device_;
    BlockForm form_ = BlockForm::stored;
    bool persistent_ = false;  // as in the wavefront
    std::unique_ptr<Residency> residency_;
    std::unique_ptr<GeometryBuffers> geometry_;
    Kernel extend_, extend_bounces_, extend_surfaces_, connect_;
    PathSlots slots_, kept_slots_;
    Buffer queue_, counters_, film_, kept_counters_, params_, ranges_;
    size_t count_ = 0;
    RayPurpose purpose_ = RayPurpose::camera;
    uint32_t round_ = 0;
};

}  // namespace raypager::bench
