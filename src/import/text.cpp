#include "import/text.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>

namespace raypager {
void split_words(std::string_view text, std::vector<std::string_view>& words) {
    words.clear();
    size_t at = 0;
    while (true) {
        while (at < text.size() && is_blank(text[at])) ++at;
        if (at == text.size()) return;
        const size_t begin = at;
        while (at < text.size() && !is_blank(text[at])) ++at;
        words.push_back(text.substr(begin, at - begin));
    }
}

size_t split_numbers(std::string_view text, std::span<std::string_view> words) {
    size_t count = 0;
    for (size_t at = 0;;) {
        while (at < text.size() && is_blank(text[at])) ++at;
        if (at == text.size()) return count;
        const size_t begin = at;
        while (at < text.size() && !is_blank(text[at]) && text[at] != ',' && text[at] != ';') ++at;
        if (count < words.size()) words[count] = text.substr(begin, at - begin);
        ++count;
        while (at < text.size() && is_blank(text[at])) ++at;
        if (at < text.size() && (text[at] == ',' || text[at] == ';')) ++at;
    }
}

std::vector<std::string_view> split_words(std::string_view text) {
    std::vector<std::string_view> words;
    split_words(text, words);
    return words;
}

std::string_view trim_line_end(std::string_view line) {
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    return line;
}

namespace {

// Bytes of the well-formed UTF-8 character that text begins with; 0 if there is none that can be shown.
size_t utf8_length(std::string_view text) {
    const auto byte = [&](size_t i) { return static_cast<unsigned char>(text[i]); };
    const unsigned char first = byte(0);
    if (first < 0x80) return first >= ' ' && first <= '~' ? 1 : 0;
    const size_t length = first >= 0xf0 ? 4 : first >= 0xe0 ? 3 : 2;
    if (first < 0xc2 || first > 0xf4 || text.size() < length) return 0;
    for (size_t i = 1; i < length; ++i)
        if ((byte(i) & 0xc0) != 0x80) return 0;
    // Overlong forms, surrogates, and what lies behind the last character; of two bytes, control characters.
    if (first == 0xe0 && byte(1) < 0xa0) return 0;
    if (first == 0xed && byte(1) > 0x9f) return 0;
    if ((first == 0xf0 && byte(1) < 0x90) || (first == 0xf4 && byte(1) > 0x8f)) return 0;
    return first == 0xc2 && byte(1) < 0xa0 ? 0 : length;
}

}  // namespace

std::string clipped(std::string_view text) {
    std::string result;
    size_t characters = 0, at = 0;
    for (; at < text.size() && characters < 40; ++characters) {
        const size_t length = utf8_length(text.substr(at));
        result += length ? std::string(text.substr(at, length)) : "?";
        at += std::max<size_t>(length, 1);
    }
    if (at < text.size()) result += "...";
    return result;
}

// As other programs write them: 1.#QNAN, -1.#IND, 1.#INF00 by Microsoft's, and 1.5D+03 by Fortran's.
static std::optional<double> parse_unusual_number(std::string_view word) {
    constexpr size_t longest = 64;
    const bool minus = word.starts_with('-');
    if (minus) word.remove_prefix(1);
    if (word.size() > longest || word.empty()) return std::nullopt;
    if (const size_t mark = word.find(".#"); mark != std::string_view::npos) {
        const auto begins = [&](std::string_view name) { return word.substr(mark + 2).starts_with(name); };
        if (word.substr(0, mark) != "1") return std::nullopt;
        if (begins("INF")) return minus ? -INFINITY : INFINITY;
        // Printed with few digits, their names are rounded: INF and IND to J, QNAN to R.
        return begins("QNAN") || begins("SNAN") || begins("IND") || begins("J") || begins("R") ? std::optional<double>(NAN) : std::nullopt;
    }
    std::string copy(word);
    const size_t exponent = copy.find_first_of("dD");
    if (exponent == std::string::npos || exponent == 0 || copy.find_first_of("eExX") != std::string::npos) return std::nullopt;
    copy[exponent] = 'e';
    double value = 0;
    const auto [end, error] = std::from_chars(copy.data(), copy.data() + copy.size(), value);
    if (error == std::errc::invalid_argument || end != copy.data() + copy.size()) return std::nullopt;
    if (error == std::errc::result_out_of_range) value = std::strtod(copy.c_str(), nullptr);
    return minus ? -value : value;
}

std::optional<double> parse_number(std::string_view word) {
    if (!word.empty() && word[0] == '+') word.remove_prefix(1);
    double value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error == std::errc::invalid_argument || end != word.data() + word.size()) return parse_unusual_number(word);
    // Out of range is too large, or too close to zero.
    if (error == std::errc::result_out_of_range) value = std::strtod(std::string(word).c_str(), nullptr);
    return value;
}

// 1.#J and 1.#R: see parse_unusual_number.
static bool is_rounded(std::string_view name) {
    return (name.starts_with('J') || name.starts_with('R')) && (name.size() == 1 || is_blank(name[1]) || name[1] == '0');
}

std::string_view without_comment(std::string_view line) {
    for (size_t at = line.find('#'); at != std::string_view::npos; at = line.find('#', at + 1)) {
        // Not the # of 1.#QNAN.
        const std::string_view behind = line.substr(at + 1, 4);
        const bool number = at > 0 && line[at - 1] == '.' && (behind.starts_with("IN") || behind == "QNAN" || behind == "SNAN" || is_rounded(behind));
        if (!number) return line.substr(0, at);
    }
    return line;
}

std::string_view name_behind_keyword(std::string_view line) {
    size_t at = 0;
    while (at < line.size() && is_blank(line[at])) ++at;
    while (at < line.size() && !is_blank(line[at])) ++at;
    std::string_view rest = line.substr(at);
    for (size_t mark = rest.find('#'); mark != std::string_view::npos; mark = rest.find('#', mark + 1)) {
        if (!is_blank(rest[mark - 1]) || (mark + 1 < rest.size() && !is_blank(rest[mark + 1]))) continue;
        rest = rest.substr(0, mark);
        break;
    }
    while (!rest.empty() && is_blank(rest.front())) rest.remove_prefix(1);
    while (!rest.empty() && is_blank(rest.back())) rest.remove_suffix(1);
    return rest;
}

}  // namespace raypager
