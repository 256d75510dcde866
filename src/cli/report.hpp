// What a render did, for scripts (--report) and for people (the lines at the end).
#pragma once

#include <array>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "cli/render_settings.hpp"
#include "raypager/blocks.hpp"
#include "raypager/report.hpp"
#include "raypager/session.hpp"

namespace raypager {

// The report's "scene" object; 'inspect --json' prints the same.
nlohmann::ordered_json scene_json(const Blocks& scene, BlockForm form);
// Its bounds: "min" and "max".
nlohmann::ordered_json bounds_json(const Blocks& scene);
std::array<double, 3> center_of(const Blocks& scene);
// The text that --camera takes for a camera that looks at it, or null if there is none. width, height: of the picture.
nlohmann::ordered_json camera_json(const Camera& camera, uint32_t width, uint32_t height, const Blocks& scene);
// All keys that scripts may rely on; every option's effective value is under "settings".
nlohmann::ordered_json report_json(const RenderSettings& settings, const RenderOptions& effective, const Blocks& scene, const RenderReport& report,
                                   const ReportSeconds& seconds);
// JSON as text; file names that are no UTF-8 do not throw.
std::string json_text(const nlohmann::ordered_json& json);

// Time, rays, and a table of what was paged; several lines.
// ground: so many of the triangles are nothing that the user brought.
std::string summary_text(const Blocks& scene, const RenderReport& report, const ReportSeconds& seconds, uint64_t ground = 0);
// "99 triangles (98 of them ground) and 5 spheres and points"
std::string primitives_text(uint64_t triangles, uint64_t spheres, uint64_t ground = 0);
// Behind it: " and 1,000 instances of 3 objects", or nothing where there are no objects.
std::string instances_text(uint64_t instances, uint64_t objects);

}  // namespace raypager
