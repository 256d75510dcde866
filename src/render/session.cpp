#include "raypager/session.hpp"

#include <chrono>

#include "render/job.hpp"

namespace raypager {

Result<MeasuredRender> render(const BlockSource& scene, const RenderOptions& options, const RenderCallbacks& callbacks,
                              const RenderInstruments& instruments) {
    RenderJob job(scene, options, callbacks, instruments);
    RAYPAGER_TRY(job.prepare());
    job.expect_progress(true);
    while (!job.done()) RAYPAGER_TRY(job.step());
    return job.finish();
}

namespace {

RenderInstruments instruments_of(const RenderOptions& options) {
    RenderInstruments instruments;
    if (!options.record.file.empty()) instruments.record_paths = options.record.paths;
    return instruments;
}

// The view or the limits may be changed, which takes the whole film.
RenderInstruments instruments_of_session(const RenderOptions& options) {
    RenderInstruments instruments = instruments_of(options);
    instruments.whole_film = true;
    return instruments;
}

Result<RenderResult> for_users(Result<MeasuredRender> measured, const RenderOptions& options) {
    if (!measured) return measured.status();
    if (measured->trace) {
        RAYPAGER_TRY(write_demand_trace(options.record.file, *measured->trace));
        measured->report.recorded_paths = measured->trace->path_count();
    }
    return RenderResult(std::move(*measured));
}

}  // namespace

Result<RenderResult> render(const Blocks& scene, const RenderOptions& options, const RenderCallbacks& callbacks) {
    return for_users(render(scene.source(), options, callbacks, instruments_of(options)), options);
}

struct Session::State {
    State(const Blocks& blocks, const RenderOptions& render_options, const RenderCallbacks& render_callbacks)
        : scene(blocks), options(render_options), callbacks(render_callbacks) {}

    const Blocks scene;
    RenderOptions options;  // the job looks here
    const RenderCallbacks callbacks;
    const RenderInstruments instruments = instruments_of_session(options);
    RenderJob job{scene.source(), options, callbacks, instruments};
};

Session::Session(std::unique_ptr<State> state) : state_(std::move(state)) {}
Session::~Session() = default;
Session::Session(Session&&) noexcept = default;
Session& Session::operator=(Session&&) noexcept = default;

Result<Session> Session::create(const Blocks& scene, const RenderOptions& options, const RenderCallbacks& callbacks) {
    auto state = std::make_unique<State>(scene, options, callbacks);
    RAYPAGER_TRY(state->job.prepare());
    return Session(std::move(state));
}

bool Session::done() const { return state_->job.done(); }

Status Session::step(double seconds) {
    using Clock = std::chrono::steady_clock;
    const auto begin = Clock::now();
    RenderJob& job = state_->job;
    job.expect_progress(true);
    while (!job.done()) {
        RAYPAGER_TRY(job.step());
        if (std::chrono::duration<double>(Clock::now() - begin).count() >= seconds) break;
    }
    job.expect_progress(false);
    return {};
}

RenderProgress Session::progress() const { return state_->job.progress(); }
Result<Image> Session::snapshot(double* spp) { return state_->job.picture(spp); }
Result<std::vector<FilmLayerImage>> Session::layers_at(uint32_t x, uint32_t y) { return state_->job.layers_at(x, y); }
std::vector<BlockStatus> Session::blocks() const { return state_->job.blocks(); }
Status Session::checkpoint() { return state_->job.write_checkpoint(); }
void Session::cancel() { state_->job.cancel(); }

Status Session::restart(const SessionView& view) {
    RAYPAGER_TRY(state_->job.hold());  // devices look at the options
    const RenderOptions before = state_->options;
    if (view.camera) state_->options.camera = view.camera;
    if (view.width) state_->options.width = view.width;
    if (view.height) state_->options.height = view.height;
    const Status status = state_->job.check_restart();
    if (status) return state_->job.restart();
    state_->options = before;
    return Status::usage(status.message());
}

Status Session::limit_geometry(uint64_t bytes, double percent) {
    RAYPAGER_TRY(state_->job.hold());
    const RenderOptions before = state_->options;
    state_->options.geometry_limit = bytes;
    state_->options.geometry_limit_percent = percent;
    state_->options.tuning.region = state_->job.region();
    const Status status = state_->job.check_limits();
    if (status) return state_->job.go_on_within_limits();
    state_->options = before;
    return Status::usage(status.message());
}

Result<RenderResult> Session::finish() { return for_users(state_->job.finish(), state_->options); }

}  // namespace raypager
