// Rays traced in streams of 64 over blocks in wide form: for CPUs.
#pragma once

#include <memory>

#include "wavefront/backend.hpp"

namespace raypager {

class StreamBackend : public Backend {
public:
    static Result<std::unique_ptr<Backend>> create(Device& device, const rp_render_params& params, const GeometryBuffers& geometry,
                                                   const WavefrontBuffers& buffers, const BackendSettings& settings);
    // Its own buffers take at most so much; queues and slots are the wavefront's.
    static constexpr uint64_t bytes_per_slot = 1, fixed_bytes = sizeof(uint64_t);
    // The queue has so many words behind those of slots: one per work-item of `wake`, for what stands for nothing.
    static constexpr uint32_t extra_queue_words = 1024;

    Status launch(const Round& round, StageEvents& events) override;
    Status check_round(const RoundCounters& counters, std::span<const rp_block_demand> demand) override;
    Status wake_all_slots() override;

private:
    using Backend::Backend;
    Status allocate();
    Status build(const BackendSettings& settings);
    uint32_t wake_items() const;

    Buffer awake_;
    Kernel begin_, wake_, generate_, trace_, shade_;
    bool notes_ = true, textures_ = false;
    std::vector<uint32_t> requests_;  // by block, as rounds have told
    uint64_t all_requests_ = 0;
};

}  // namespace raypager
