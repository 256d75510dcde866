// What is kept of a render for those who study it afterwards: when which block came and went, and which blocks its paths entered.
#pragma once

#include <optional>
#include <vector>

#include "render/render.hpp"
#include "residency/residency.hpp"
#include "wavefront/visit_recorder.hpp"
#include "wavefront/wavefront.hpp"

namespace raypager {

class RenderRecorder {
public:
    // instruments: how much is asked for; nothing, usually.
    void begin(const RenderTuning& tuning, const RenderInstruments& instruments, const rp_render_params& params, uint32_t cpu_cores);
    // After every round. seconds: of rendering so far. REQUIRES: no other round under way, if visits are recorded.
    Status round_ended(Wavefront& wavefront, double seconds);
    // Fills journal, round_seconds and trace of a result whose report is complete.
    void finish(const BakedScene& scene, const Residency& residency, const rp_render_params& params, MeasuredRender& result);

private:
    bool journal_ = false, wait_for_loads_ = false;
    uint32_t cpu_cores_ = 0;
    std::optional<VisitRecorder> visits_;
    std::vector<uint32_t> events_;
    std::vector<float> round_seconds_;
};

}  // namespace raypager
