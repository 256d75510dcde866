#include "import/text.hpp"

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

std::string clipped(std::string_view text) {
    std::string result(text.substr(0, 40));
    for (char& c : result)
        if (c < ' ' || c > '~') c = '?';
    if (text.size() > 40) result += "...";
    return result;
}

std::optional<double> parse_number(std::string_view word) {
    if (!word.empty() && word[0] == '+') word.remove_prefix(1);
    double value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error == std::errc::invalid_argument || end != word.data() + word.size()) return std::nullopt;
    // Out of range is too large, or too close to zero.
    if (error == std::errc::result_out_of_range) value = std::strtod(std::string(word).c_str(), nullptr);
    return value;
}

NumberKind classify_number(std::string_view word) {
    if (!word.empty() && word[0] == '+') word.remove_prefix(1);
    float value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error == std::errc::invalid_argument || end != word.data() + word.size()) return NumberKind::none;
    // Out of range is too large or too close to zero; the latter rounds to zero like any other number.
    if (error == std::errc::result_out_of_range) value = std::strtof(std::string(word).c_str(), nullptr);
    return std::isfinite(value) ? NumberKind::finite : NumberKind::not_finite;
}

}  // namespace raypager
