#include "cli/traverse_options.hpp"

namespace raypager {

void add_traverse_options(OptionParser& parser, TraverseSettings& settings) {
    parser.inputs("the block file", 1, 1, settings.inputs);
    parser.option("size", "WxH", "camera rays (default: 1024x1024)", into(settings.size, parse_image_size));
    parser.option("camera", "E,T,U,F", "eye, target, up (x,y,z each) and field of view in degrees (default: the scene's)",
                  into(settings.camera, parse_camera));
    parser.option("light", "BOX", "x,y,z,X,Y,Z: the box in which shadow rays end (default: above the scene)",
                  into(settings.options.light, parse_box));
    parser.option("ceiling", "BOX", "x,y,z,X,Y,Z: where camera rays that miss the scene end (default: they go no further)",
                  into(settings.options.ceiling, parse_box));
    parser.option("repeats", "N", "times that each set is traced (default: 5)", into_count(settings.options.repeats, 1, 1000));
    parser.option("traversal", "NAME", "auto, ray or stream (default: auto, streams on CPUs)", into(settings.options.traversal, parse_traversal));
}

bench::TraverseOptions traverse_options(const TraverseSettings& settings) {
    bench::TraverseOptions options = settings.options;
    options.width = settings.size.width;
    options.height = settings.size.height;
    if (const auto& camera = settings.camera) options.camera = make_camera(*camera, options.width, options.height);
    return options;
}

}  // namespace raypager
