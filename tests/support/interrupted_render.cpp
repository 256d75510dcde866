#include "support/interrupted_render.hpp"

namespace raypager::support {

Result<MeasuredRender> render_rounds(const BlockFile& file, TestOptions options, uint32_t rounds, RenderCallbacks callbacks) {
    std::atomic<bool> stop{false};
    uint32_t ended = 0;
    // Progress is told once after every round, after the look at the stop flag.
    options.progress_seconds = 0;
    options.stop = &stop;
    callbacks.progress = [&, next = callbacks.progress](const RenderProgress& progress) {
        if (next) next(progress);
        stop = ++ended + 1 == rounds;
    };
    if (rounds == 1) stop = true;
    return render(file, options, callbacks);
}

}  // namespace raypager::support
