// What the page asks for, from the text of its requests. Errors say what was expected; nothing of it has been looked at before.
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "raypager/camera_text.hpp"
#include "raypager/status.hpp"

namespace raypager {

struct CameraCommand {
    CameraText camera;
    bool moving = false;  // more will follow at once: a small picture will do
};
// {"camera": "as --camera takes it", "moving": true}
Result<CameraCommand> parse_camera_command(const std::string& body);

struct LimitCommand {
    uint64_t bytes = 0;  // 0, and no percent: no limit but that of memory
    double percent = 0;
};
// {"limit": "25%"}, {"limit": "512M"} or {"limit": ""}
Result<LimitCommand> parse_limit_command(const std::string& body);

using Query = std::map<std::string, std::string>;

struct PixelQuery {
    uint32_t x = 0, y = 0;
};
// x=12&y=7, in a picture of this size
Result<PixelQuery> parse_pixel_query(const Query& query, uint32_t width, uint32_t height);

struct SaveQuery {
    std::string ending;   // ".png" or ".exr"
    double exposure = 0;  // in stops
};
// format=png&exposure=0.5
Result<SaveQuery> parse_save_query(const Query& query);

// after=12: the number of the picture that the page has; 0 if it says nothing of the kind.
uint64_t parse_after(const Query& query);

}  // namespace raypager
