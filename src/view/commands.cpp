#include "view/commands.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "base/numbers.hpp"

namespace raypager {
namespace {

constexpr double max_stops = 64;

Result<nlohmann::json> parse_object(const std::string& body) {
    nlohmann::json json = nlohmann::json::parse(body, nullptr, false);
    if (!json.is_object()) return Status::usage("a JSON object was expected");
    return json;
}

Result<std::string> string_in(const nlohmann::json& json, const char* key) {
    const auto found = json.find(key);
    if (found == json.end() || !found->is_string()) return Status::usage(fmt::format("\"{}\": a text was expected", key));
    return found->get<std::string>();
}

std::optional<uint64_t> whole_number(const Query& query, const char* key) {
    const auto found = query.find(key);
    if (found == query.end()) return std::nullopt;
    uint64_t value = 0;
    const char* const end = found->second.data() + found->second.size();
    const auto [stopped, error] = std::from_chars(found->second.data(), end, value);
    if (error != std::errc() || stopped != end) return std::nullopt;
    return value;
}

}  // namespace

Result<CameraCommand> parse_camera_command(const std::string& body) {
    const auto json = parse_object(body);
    if (!json) return json.status();
    const auto text = string_in(*json, "camera");
    if (!text) return text.status();
    const auto camera = parse_camera(*text);
    if (!camera) return camera.status();
    const auto moving = json->find("moving");
    return CameraCommand{*camera, moving != json->end() && moving->is_boolean() && moving->get<bool>()};
}

Result<LimitCommand> parse_limit_command(const std::string& body) {
    const auto json = parse_object(body);
    if (!json) return json.status();
    const auto text = string_in(*json, "limit");
    if (!text) return text.status();
    if (text->empty()) return LimitCommand();
    const auto limit = parse_size_or_percent(*text);
    if (!limit) return limit.status();
    return LimitCommand{limit->bytes, limit->percent};
}

Result<PixelQuery> parse_pixel_query(const Query& query, uint32_t width, uint32_t height) {
    const auto x = whole_number(query, "x"), y = whole_number(query, "y");
    if (!x || !y || *x >= width || *y >= height) return Status::usage(fmt::format("x and y of a pixel of {}x{} were expected", width, height));
    return PixelQuery{static_cast<uint32_t>(*x), static_cast<uint32_t>(*y)};
}

Result<SaveQuery> parse_save_query(const Query& query) {
    SaveQuery save;
    const auto format = query.find("format");
    if (format == query.end() || (format->second != "png" && format->second != "exr")) return Status::usage("format: png or exr was expected");
    save.ending = "." + format->second;
    const auto exposure = query.find("exposure");
    if (exposure == query.end()) return save;
    const auto stops = parse_finite(exposure->second);
    if (!stops || !(std::abs(*stops) <= max_stops)) return Status::usage("exposure: a number from -64 to 64 was expected");
    save.exposure = *stops;
    return save;
}

uint64_t parse_after(const Query& query) { return whole_number(query, "after").value_or(0); }

}  // namespace raypager
