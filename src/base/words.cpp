#include "base/words.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

namespace raypager {

std::string format_bytes(uint64_t bytes) {
    constexpr std::array<const char*, 4> units = {"KiB", "MiB", "GiB", "TiB"};
    if (bytes < 1000) return counted(bytes, "byte");
    double value = static_cast<double>(bytes) / 1024;
    size_t index = 0;
    for (; value >= 1000 && index + 1 < units.size(); ++index) value /= 1024;
    const int digits = value >= 100 ? 0 : value >= 10 ? 1 : 2;
    return fmt::format("{:.{}f} {}", value, digits, units[index]);
}

std::string format_exact_bytes(uint64_t bytes) {
    return bytes < 1000 ? format_bytes(bytes) : fmt::format("{} bytes ({})", bytes, format_bytes(bytes));
}

std::string format_count(uint64_t count) {
    std::string text = std::to_string(count);
    for (size_t at = text.size(); at > 3; at -= 3) text.insert(at - 3, 1, ',');
    return text;
}

std::string format_share(double share) {
    const double percent = 100 * share;
    if (percent > 0 && percent < 0.05) return "less than 0.1 %";
    if (percent >= 99.95 && percent < 100) return "more than 99.9 %";
    return fmt::format("{:.1f} %", percent);
}

std::string format_duration(double seconds) {
    if (!(seconds >= 0)) seconds = 0;
    if (seconds < 10) return fmt::format("{:.2f} s", seconds);
    if (seconds < 60) return fmt::format("{:.1f} s", seconds);
    const auto whole = static_cast<uint64_t>(std::min(seconds, 1e12));
    if (whole < 3600) return fmt::format("{}:{:02}", whole / 60, whole % 60);
    return fmt::format("{}:{:02}:{:02}", whole / 3600, whole / 60 % 60, whole % 60);
}

std::string counted(uint64_t count, std::string_view noun, std::string_view plural) {
    const std::string many = plural.empty() ? std::string(noun) + "s" : std::string(plural);
    return format_count(count) + " " + (count == 1 ? std::string(noun) : many);
}

std::string shortened(std::string_view text, size_t most) {
    if (text.size() <= most) return std::string(text);
    return std::string(text.substr(0, most - std::min<size_t>(most, 3))) + "...";
}

}  // namespace raypager
