// A render's options as tests set them: those of users, and those that only tests have.
#pragma once

#include "render/render.hpp"

namespace raypager::support {

struct TestOptions : RenderOptions {
    TestOptions() = default;
    TestOptions(const RenderOptions& options) : RenderOptions(options) {}
    RenderInstruments instruments;
};

inline Result<MeasuredRender> render(const BlockSource& scene, const TestOptions& options, const RenderCallbacks& callbacks) {
    return raypager::render(scene, options, callbacks, options.instruments);
}

}  // namespace raypager::support
