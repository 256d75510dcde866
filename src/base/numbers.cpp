#include "base/numbers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <utility>

namespace raypager {
namespace {

constexpr double largest_size = 1152921504606846976.0;  // 2^60 bytes: sums of a few sizes stay far inside 64 bits

// The number that text starts with, and what stands behind it.
std::optional<std::pair<double, std::string_view>> leading_number(std::string_view text) {
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, std::chars_format::general);
    if (error != std::errc() || !std::isfinite(value)) return std::nullopt;
    return std::pair(value, text.substr(static_cast<size_t>(end - text.data())));
}

std::optional<double> whole_number_text(std::string_view text) {
    const auto parsed = leading_number(text);
    if (!parsed || !parsed->second.empty()) return std::nullopt;
    return parsed->first;
}

// What a unit multiplies by: base^1 for K, base^2 for M, ...; nothing for anything else.
std::optional<double> unit(std::string_view letter, double base) {
    if (letter.empty()) return 1;
    if (letter.size() != 1) return std::nullopt;
    const size_t power = std::string_view("KMGTkmgt").find(letter[0]);
    if (power == std::string_view::npos) return std::nullopt;
    return std::pow(base, static_cast<double>(power % 4 + 1));
}

// What stands behind the number of a size: "M", "MB", "MiB", "mb", " GB", "B", "bytes".
std::optional<double> size_unit(std::string_view text) {
    if (text.starts_with(' ') && text.size() > 1) text.remove_prefix(1);
    if (text == "bytes" || text == "byte" || text == "B" || text == "b") return 1;
    if (text.size() > 1 && (text.back() == 'B' || text.back() == 'b')) {
        text.remove_suffix(1);
        if (text.size() > 1 && (text.back() == 'i' || text.back() == 'I')) text.remove_suffix(1);
    }
    return unit(text, 1024);
}

bool is_digit(char c) { return c >= '0' && c <= '9'; }

// A whole number without the commas or underscores that part its thousands: 1,000,000. Any other text as it is.
std::string without_separators(std::string_view text) {
    const char mark = text.find('_') != std::string_view::npos ? '_' : ',';
    const size_t first = text.find(mark), end = text.find_first_not_of("0123456789,_");
    if (first == std::string_view::npos || first == 0 || first > 3 || end != std::string_view::npos) return std::string(text);
    std::string digits(text.substr(0, first));
    for (size_t at = first; at < text.size(); at += 4) {
        const std::string_view group = text.substr(at, 4);
        if (group.size() != 4 || group[0] != mark || !std::all_of(group.begin() + 1, group.end(), is_digit)) return std::string(text);
        digits += group.substr(1);
    }
    return digits;
}

}  // namespace

Result<uint64_t> parse_size(std::string_view text) {
    const std::string number = without_separators(text);
    const auto parsed = leading_number(number);
    const auto factor = parsed ? size_unit(parsed->second) : std::nullopt;
    const double bytes = factor ? parsed->first * *factor : 0;
    if (!(bytes >= 1 && bytes <= largest_size))
        return Status::usage(
            fmt::format("'{}' is not a size; give bytes, or a number with a unit such as 512K, 1.5G, 8GB or 8GiB (all binary)", text));
    return static_cast<uint64_t>(bytes);
}

Result<SizeOrPercent> parse_size_or_percent(std::string_view text) {
    if (!text.ends_with('%')) {
        const auto size = parse_size(text);
        if (!size) return Status::usage(size.status().message() + ", or a percentage such as 25%");
        return SizeOrPercent{*size, 0};
    }
    const auto percent = whole_number_text(text.substr(0, text.size() - 1));
    if (!percent || !(*percent > 0 && *percent <= 100)) return Status::usage(fmt::format("'{}' is not a percentage over 0% and at most 100%", text));
    return SizeOrPercent{0, *percent};
}

Result<double> parse_share(std::string_view text) {
    const auto percent = text.ends_with('%') ? whole_number_text(text.substr(0, text.size() - 1)) : std::nullopt;
    if (!percent || !(*percent >= 0 && *percent <= 100)) return Status::usage(fmt::format("'{}' is not a percentage from 0% to 100%", text));
    return *percent / 100;
}

Result<uint64_t> parse_count(std::string_view text, uint64_t lowest, uint64_t highest) {
    const auto wrong = [&] {
        const char* hint = highest >= 1000 ? "; K, M and G may stand behind it, as in 2.5M" : "";
        return Status::usage(fmt::format("'{}' is not a whole number from {} to {}{}", text, lowest, highest, hint));
    };
    const std::string number = without_separators(text);
    const auto parsed = leading_number(number);
    std::string_view suffix = parsed ? parsed->second : std::string_view();
    if (suffix.size() == 2 && suffix.front() == ' ') suffix.remove_prefix(1);
    const auto factor = parsed && suffix != "T" && suffix != "t" ? unit(suffix, 1000) : std::nullopt;
    if (!factor) return wrong();
    // A rounding error of the decimal fraction (1.1M) must not make the number a broken one.
    const double count = suffix.empty() ? parsed->first : std::round(parsed->first * *factor * 1e3) / 1e3;
    if (!(count >= double(lowest) && count <= double(highest)) || count != std::floor(count)) return wrong();
    return static_cast<uint64_t>(count);
}

Result<double> parse_seconds(std::string_view text) {
    const auto seconds = whole_number_text(text);
    if (!seconds || !(*seconds > 0 && *seconds <= 1e9)) return Status::usage(fmt::format("'{}' is not a number of seconds over 0", text));
    return *seconds;
}

Result<double> parse_finite(std::string_view text) {
    const auto number = whole_number_text(text);
    if (!number) return Status::usage(fmt::format("'{}' is not a number", text));
    return *number;
}

Result<double> parse_positive(std::string_view text) {
    const auto number = whole_number_text(text);
    if (!number || !(static_cast<float>(*number) > 0 && static_cast<float>(*number) <= std::numeric_limits<float>::max()))
        return Status::usage(fmt::format("'{}' is not a number over 0", text));
    return *number;
}

}  // namespace raypager
