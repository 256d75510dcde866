#include "cli/point_options.hpp"

#include <fmt/format.h>

#include "cli/values.hpp"

namespace raypager {

void add_point_options(OptionParser& parser, PointOptions& options) {
    parser.option("point-radius", "R|auto",
                  "radius of all points, in the scene's units; auto: from the spacing around each (default: as the input says, auto "
                  "where it does not)",
                  [&options](const std::string& text) -> Status {
                      options.radius_from_spacing = text == "auto";
                      options.radius = 0;
                      return options.radius_from_spacing ? Status() : into(options.radius, parse_positive)(text);
                  });
    parser.option("point-scale", "F", "times that radius, where it is not a given one (default: 1)", into(options.radius_scale, parse_positive));
    parser.option("columns", "x,y,z,...",
                  "what the columns of text clouds are: x y z i r g b class radius, and _ for what is passed over (default: as their first line "
                  "names them, or as they look)",
                  into(options.columns, parse_point_columns));
    parser.flag("cull-to-camera", "leave out points that the camera does not see; what they would reflect or shade is lost (default: keep all)",
                options.cull_to_camera);
    parser.option("cull-margin", "F", "keep points beyond the border of the picture by this share of half its sides (default: 0.1)",
                  [&options](const std::string& text) -> Status {
                      if (text != "0") return into(options.cull_margin, parse_positive)(text);
                      options.cull_margin = 0;
                      return {};
                  });
    parser.flag("filter-to-image", "keep about one point for each pixel of the picture that they cover (default: keep all)", options.filter_to_image);
}

bool changes_points(const PointOptions& options) {
    const PointOptions defaults;
    return options.radius != defaults.radius || options.radius_from_spacing || options.radius_scale != defaults.radius_scale ||
           options.cull_to_camera || options.filter_to_image || !options.columns.empty();
}

}  // namespace raypager
