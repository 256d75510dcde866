// The options that say what bare meshes and clouds look like.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "cli/option_parser.hpp"
#include "raypager/import.hpp"

namespace raypager {

// The options as they were typed, for reports.
struct LookTexts {
    std::optional<std::string> material, sky, light, background;
};

// --material, --sky, --light and --no-ground.
void add_look_options(OptionParser& parser, BareLook& look, LookTexts& texts);
// Keeps the text beside what becomes of it.
OptionParser::Setter keeping_text(std::optional<std::string>& text, OptionParser::Setter set);
// A usage error where they were given with inputs that are no bare ones.
Status check_look_options(const OptionParser& parser, const BareLook& look, const std::vector<std::filesystem::path>& inputs);

// "R,G,B" (linear, 0 or more) or "#rrggbb" (sRGB).
Result<Float3> parse_color(const std::string& text);
Result<rp_material> parse_material(const std::string& text);
Result<Float3> parse_sky(const std::string& text);
Result<BareLight> parse_light(const std::string& text);

}  // namespace raypager
