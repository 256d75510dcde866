// What a render did, as data.
#pragma once

#include <string>

#include "raypager/blocks.hpp"
#include "raypager/session.hpp"
#include "raypager/status.hpp"

namespace raypager {

struct ReportSeconds {
    double total = 0, bake = 0, denoise = 0;  // of the whole program, and of its parts before and after rendering; the rest is in RenderReport
};

// A JSON object with all figures, in the keys of the command line's --report: raypager, device, scene, limits, peak, image, layers, camera, bounds,
// seconds, rays, paging, checkpoint, and settings, the effective values of what options ask for. Bytes, seconds, counts. Names that are no UTF-8 are
// mended.
std::string report_text(const Blocks& scene, const RenderOptions& options, const RenderReport& report, const ReportSeconds& seconds);
// What is in a scene, as the report's "scene" has it: of blocks in the form that a device has them in.
std::string scene_text(const Blocks& scene, BlockForm form);
// Its bounds: "min" and "max".
std::string bounds_text(const Blocks& scene);
// Names and values, as the report's "settings" have them under "tune"; null: nothing is changed.
std::string tuning_text(const ProfileChanges& tuning);

}  // namespace raypager
