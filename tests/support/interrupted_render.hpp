// Renders that are stopped after a number of rounds, as a signal would stop them.
#pragma once

#include <atomic>
#include <cstdint>

#include "render/render.hpp"
#include "store/block_file.hpp"
#include "support/test_options.hpp"

namespace raypager::support {

// Renders until so many rounds have ended; 0: to the end.
Result<MeasuredRender> render_rounds(const BlockFile& file, TestOptions options, uint32_t rounds, RenderCallbacks callbacks = {});

}  // namespace raypager::support
