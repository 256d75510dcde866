#include "render/recorder.hpp"

#include <algorithm>

namespace raypager {

void RenderRecorder::begin(const RenderTuning& tuning, const RenderInstruments& instruments, const rp_render_params& params, uint32_t cpu_cores) {
    journal_ = instruments.keep_journal;
    wait_for_loads_ = tuning.wait_for_loads;
    cpu_cores_ = cpu_cores;
    if (instruments.record_paths) visits_.emplace(params.width, params.height, params.order);
}

Status RenderRecorder::round_ended(Wavefront& wavefront, double seconds) {
    if (journal_) round_seconds_.push_back(static_cast<float>(seconds));
    if (!visits_) return {};
    RAYPAGER_TRY(wavefront.read_visits(events_));
    visits_->take(events_);
    return {};
}

void RenderRecorder::finish(const BakedScene& scene, const Residency& residency, const rp_render_params& params, MeasuredRender& result) {
    result.journal = residency.journal();
    result.round_seconds = std::move(round_seconds_);
    if (!visits_ || !result.report.complete) return;
    const RenderReport& report = result.report;
    DemandTrace& trace = result.trace.emplace();
    RecordedRender& recorded = trace.recorded;
    recorded.device = report.device.name;
    recorded.policy = residency.policy();
    recorded.pool_bytes = residency.pool_bytes();
    for (const Buffer& slab : residency.slabs()) recorded.slab_bytes = std::max(recorded.slab_bytes, slab.bytes());
    recorded.slots = params.slot_count;
    recorded.wait_for_loads = wait_for_loads_;
    recorded.cpu_cores = cpu_cores_;
    recorded.rounds_under_way = 1;  // rounds that are recorded run one by one
    recorded.paths = report.rays.camera;
    recorded.rays = report.rays.total();
    recorded.loads = report.paging.loads;
    recorded.bytes_loaded = report.paging.bytes_loaded;
    recorded.rounds = report.paging.rounds;
    recorded.seconds = report.seconds.render;
    recorded.trace_seconds = report.seconds.trace;
    recorded.scene_identity = scene.identity();
    for (uint32_t block = 0; block < scene.pageable_count(); block++) trace.block_bytes.push_back(scene.pageable_bytes(block, BlockForm::stored));
    visits_->finish(trace);
}

}  // namespace raypager
