#include "cli/values.hpp"

#include <fmt/format.h>

#include <cstdio>
#include <utility>

namespace raypager {
namespace {

constexpr uint64_t largest_picture = uint64_t{1} << 28, largest_side = uint64_t{1} << 20;

}  // namespace

Result<PolicyKind> parse_policy(std::string_view text) {
    if (const auto kind = policy_from_name(text)) return *kind;
    std::string names;
    for (const PolicyName& policy : policy_names) names += fmt::format("{}{}", names.empty() ? "" : ", ", policy.name);
    return Status::usage(fmt::format("'{}' is not a policy; use one of {}", text, names));
}

Result<Connection> parse_connection(std::string_view text) {
    if (text == "queue") return Connection::queue;
    if (text == "roulette") return Connection::roulette;
    return Status::usage(fmt::format("'{}' is not a kind of connection; use queue or roulette", text));
}

Result<ImageSize> parse_image_size(std::string_view text) {
    const size_t cross = text.find('x');
    if (cross != std::string_view::npos) {
        const auto width = parse_count(text.substr(0, cross), 1, largest_side);
        const auto height = parse_count(text.substr(cross + 1), 1, largest_side);
        if (width && height && *width * *height <= largest_picture) return ImageSize{static_cast<uint32_t>(*width), static_cast<uint32_t>(*height)};
    }
    return Status::usage(fmt::format("'{}' is not a size of a picture; give WIDTHxHEIGHT, each from 1 to 2^20, of at most 2^28 pixels", text));
}

Result<Traversal> parse_traversal(const std::string& text) {
    if (const auto traversal = traversal_from_name(text)) return *traversal;
    return Status::usage(fmt::format("'{}' is not a kind of traversal; use auto, ray or stream", text));
}

Result<std::pair<Float3, Float3>> parse_box(const std::string& text) {
    Float3 low, high;
    int used = 0;
    const int read = std::sscanf(text.c_str(), "%f,%f,%f,%f,%f,%f%n", &low.x, &low.y, &low.z, &high.x, &high.y, &high.z, &used);
    if (read != 6 || static_cast<size_t>(used) != text.size()) return Status::usage(fmt::format("'{}': six numbers x,y,z,X,Y,Z are expected", text));
    return std::pair(low, high);
}

}  // namespace raypager
