// Pictures from all around: one bake, one render after the other.
#pragma once

#include <chrono>
#include <filesystem>

#include "cli/render_settings.hpp"
#include "cli/scene_cache.hpp"

namespace raypager {

// Picture number `index` of `count`: "bust.png" is bust_000.png, bust_001.png, ...; with more digits where there are more than a thousand.
std::filesystem::path turntable_picture(const std::filesystem::path& output, uint32_t index, uint32_t count);

// Renders them all and writes the report, which is that of the last picture with a list of all under "turntable". begin: of the program's work.
Status render_turntable(const RenderSettings& settings, const RenderOptions& options, const OpenedScene& opened,
                        std::chrono::steady_clock::time_point begin);

}  // namespace raypager
