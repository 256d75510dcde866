#include "cli/look_options.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <optional>
#include <span>
#include <string_view>

#include "cli/output_paths.hpp"
#include "raypager/materials.hpp"

namespace raypager {
namespace {

constexpr float usual_roughness = 0.1f;  // of metals: a satin finish
constexpr double usual_ior = 1.5;
constexpr double brightest = 1e6;

std::vector<std::string> split(const std::string& text, char between) {
    std::vector<std::string> words;
    size_t begin = 0;
    for (size_t end; (end = text.find(between, begin)) != std::string::npos; begin = end + 1) words.push_back(text.substr(begin, end - begin));
    words.push_back(text.substr(begin));
    return words;
}

std::optional<double> number_within(const std::string& text, double lowest, double highest) {
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size() || !(value >= lowest && value <= highest)) return std::nullopt;
    return value;
}

float linear_of_srgb(uint32_t byte) {
    const double v = byte / 255.0;
    return static_cast<float>(v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4));
}

std::optional<Float3> color_from_hex(const std::string& text) {
    if (text.size() != 7 || text[0] != '#') return std::nullopt;
    uint32_t bits = 0;
    const auto [end, error] = std::from_chars(text.data() + 1, text.data() + text.size(), bits, 16);
    if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
    return Float3{linear_of_srgb(bits >> 16), linear_of_srgb(bits >> 8 & 255), linear_of_srgb(bits & 255)};
}

std::optional<Float3> color_within(std::span<const std::string> words, double highest) {
    if (words.size() == 1) return color_from_hex(words[0]);
    if (words.size() != 3) return std::nullopt;
    std::array<float, 3> c = {};
    for (size_t i = 0; i < 3; i++) {
        const auto value = number_within(words[i], 0, highest);
        if (!value) return std::nullopt;
        c[i] = static_cast<float>(*value);
    }
    return Float3{c[0], c[1], c[2]};
}

// What is behind a name or a colour, which it takes off the words; the usual one if there is none, nothing if it makes no sense.
std::optional<float> take_roughness(std::vector<std::string>& words) {
    if (words.size() != 2 && words.size() != 4) return usual_roughness;
    const auto given = number_within(words.back(), 0, 1);
    if (!given) return std::nullopt;
    words.pop_back();
    return static_cast<float>(*given);
}

// "NAME", "R,G,B" or "#rrggbb", and perhaps ",roughness" behind it.
std::optional<rp_material> metal_of(const std::string& text) {
    std::vector<std::string> words = split(text, ',');
    const auto roughness = take_roughness(words);
    if (!roughness) return std::nullopt;
    if (words.size() == 1)
        if (const auto metal = named_metal(words[0], *roughness)) return metal;
    const auto color = color_within(words, 1);
    return color ? std::optional(conductor_of_reflectance(*color, *roughness)) : std::nullopt;
}

// "R,G,B" or "#rrggbb", and perhaps ",roughness" behind it.
std::optional<rp_material> plastic_of(const std::string& text) {
    std::vector<std::string> words = split(text, ',');
    const auto roughness = take_roughness(words);
    const auto color = color_within(words, 1);
    return roughness && color ? std::optional(coated_diffuse_material(*color, usual_ior, *roughness)) : std::nullopt;
}

std::optional<rp_material> material_of(const std::string& kind, const std::string& rest, bool has_rest) {
    if (kind == "diffuse" && has_rest) {
        const auto color = color_within(split(rest, ','), 1);
        return color ? std::optional(diffuse_material(*color)) : std::nullopt;
    }
    if (kind == "metal" && has_rest) return metal_of(rest);
    if (kind == "plastic" && has_rest) return plastic_of(rest);
    if (kind == "glass") {
        const auto ior = has_rest ? number_within(rest, 1, 10) : usual_ior;
        return ior ? std::optional(dielectric_material(static_cast<float>(*ior))) : std::nullopt;
    }
    if (has_rest) return std::nullopt;
    if (kind == "clay") return clay_material();
    if (kind == "white") return diffuse_material({0.8f, 0.8f, 0.8f});
    if (kind == "grey" || kind == "gray") return diffuse_material({0.4f, 0.4f, 0.4f});
    if (kind == "black") return diffuse_material({0.03f, 0.03f, 0.03f});
    if (kind == "mirror") return conductor_of_reflectance({1, 1, 1}, 0);
    return named_metal(kind, kind == "chrome" ? 0 : usual_roughness);
}

// What was given that is for bare inputs alone; null: nothing.
const char* given_look_option(const BareLook& look) {
    return look.material                               ? "material"
           : look.sky                                  ? "sky"
           : look.light.kind != BareLight::Kind::usual ? "light"
           : look.no_ground                            ? "no-ground"
                                                       : nullptr;
}

// Block files, and scenes, packed ones as well.
bool says_its_looks(const std::filesystem::path& input, std::string_view option) {
    const std::filesystem::path unpacked = has_ending(input, ".gz") ? input.stem() : input;
    // glTF and USD files often have no light; their materials are their own.
    for (const char* ending : {".gltf", ".glb", ".usd", ".usda", ".usdc", ".usdz"})
        if (has_ending(unpacked, ending)) return option == "material";
    return has_ending(unpacked, ".rpb") || has_ending(unpacked, ".pbrt");
}

bool names_a_file(const std::string& text) {
    const std::string ending = std::filesystem::path(text).extension().string();
    std::error_code ignored;
    return std::ranges::any_of(ending, [](unsigned char c) { return std::isalpha(c) != 0; }) || std::filesystem::is_regular_file(text, ignored);
}

}  // namespace

Result<Float3> parse_color(const std::string& text) {
    const auto color = color_within(split(text, ','), brightest);
    if (!color) return Status::usage(fmt::format("'{}' is not a colour; give three numbers R,G,B from 0 on (linear), or #rrggbb (sRGB)", text));
    return *color;
}

Result<rp_material> parse_material(const std::string& text) {
    const size_t colon = text.find(':');
    auto material = material_of(text.substr(0, colon), colon == std::string::npos ? "" : text.substr(colon + 1), colon != std::string::npos);
    if (!material)
        return Status::usage(fmt::format(
            "'{}' is not a material; use clay, white, grey, black, gold, silver, copper, brass, aluminium, chrome, mirror, glass[:IOR] (1 to 10), "
            "diffuse:R,G,B, plastic:R,G,B[,roughness] or metal:R,G,B[,roughness] (each 0 to 1; or #rrggbb for R,G,B), or metal:NAME[,roughness]",
            text));
    material->flags |= RP_MATERIAL_PLAIN;
    return *material;
}

Result<Float3> parse_sky(const std::string& text) {
    if (text == "none") return Float3{0, 0, 0};
    if (const auto color = color_within(split(text, ','), brightest)) return *color;
    if (names_a_file(text)) return Status::usage(fmt::format("'{}': skies cannot be pictures yet; give a colour R,G,B or #rrggbb, or none", text));
    return Status::usage(fmt::format("'{}' is not a sky; give a colour R,G,B (linear radiance) or #rrggbb (sRGB), or none", text));
}

Result<BareLight> parse_light(const std::string& text) {
    const auto wrong = [&] {
        return Status::usage(
            fmt::format("'{}' is not a light; use none, key[:STRENGTH] or sun[:AZIMUTH,ELEVATION[,STRENGTH]], with azimuths from -360 to 360 and "
                        "elevations from 0 to 90 degrees, and strengths over 0, where 1 is as usual",
                        text));
    };
    const size_t colon = text.find(':');
    const std::string kind = text.substr(0, colon);
    const std::vector<std::string> words = colon == std::string::npos ? std::vector<std::string>() : split(text.substr(colon + 1), ',');
    BareLight light;
    if (kind == "none" && colon == std::string::npos) {
        light.kind = BareLight::Kind::none;
        return light;
    }
    light.kind = kind == "sun" ? BareLight::Kind::sun : BareLight::Kind::key;
    const size_t places = kind == "sun" ? 2 : 0;
    const bool counts = words.empty() ? true : kind == "sun" ? words.size() == 2 || words.size() == 3 : words.size() == 1;
    if ((kind != "sun" && kind != "key") || !counts) return wrong();
    if (!words.empty() && places == 2) {
        const auto azimuth = number_within(words[0], -360, 360), elevation = number_within(words[1], 0, 90);
        if (!azimuth || !elevation) return wrong();
        light.place = BareLight::Place{*azimuth, *elevation};
    }
    if (words.size() > places) {
        const auto strength = number_within(words.back(), 0, brightest);
        if (!strength || *strength == 0) return wrong();
        light.strength = *strength;
    }
    return light;
}

OptionParser::Setter keeping_text(std::optional<std::string>& text, OptionParser::Setter set) {
    return [&text, set = std::move(set)](const std::string& given) {
        text = given;
        return set(given);
    };
}

void add_look_options(OptionParser& parser, BareLook& look, LookTexts& texts) {
    parser.option("material", "SPEC",
                  "of bare meshes and clouds: clay, white, grey, black, gold, silver, copper, brass, aluminium, chrome, mirror, glass[:IOR], "
                  "diffuse:R,G,B, plastic:R,G,B[,roughness], metal:NAME[,roughness] or metal:R,G,B[,roughness]; colours are linear, 0 to 1, or "
                  "#rrggbb in sRGB; roughness is "
                  "GGX alpha, 0 to 1 (default: what the files say, clay where they do not; metals 0.1, chrome and mirror smooth; glass 1.5)",
                  keeping_text(texts.material, into(look.material, parse_material)));
    parser.option("sky", "R,G,B|none",
                  "light from everywhere around bare meshes and clouds, and glTF scenes without a light: linear radiance, or #rrggbb in sRGB "
                  "(default: 0.22,0.25,0.3; over "
                  "landscapes 0.42,0.55,0.75)",
                  keeping_text(texts.sky, into(look.sky, parse_sky)));
    parser.option("light", "SPEC",
                  "that bare meshes and clouds, and glTF scenes without one, get: none, key[:STRENGTH], a square at the viewer's left that is not in "
                  "the picture itself, or "
                  "sun[:AZIMUTH,ELEVATION[,STRENGTH]], in degrees to the right of the default camera and above the ground; strength 1 is as usual "
                  "(default: key; over landscapes sun)",
                  keeping_text(texts.light, into(look.light, parse_light)));
    parser.flag("no-ground", "bare meshes and clouds hang in the air (default: objects stand on a disc)", look.no_ground);
}

Status check_look_options(const OptionParser& parser, const BareLook& look, const std::vector<std::filesystem::path>& inputs) {
    const char* given = given_look_option(look);
    if (given == nullptr) return {};
    for (const auto& input : inputs)
        if (says_its_looks(input, given))
            return parser.wrong(fmt::format("--{}: is for bare meshes and point clouds; '{}' says itself what it looks like", given, input.string()));
    return {};
}

}  // namespace raypager
