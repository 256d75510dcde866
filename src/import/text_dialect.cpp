#include "import/text_dialect.hpp"

#include <algorithm>
#include <array>

#include "import/text.hpp"

namespace raypager {
namespace {

bool is_quote(char c) { return c == '"' || c == '\''; }
bool is_digit(char c) { return c >= '0' && c <= '9'; }

std::optional<double> parse_rewritten(std::string_view word, bool decimal_comma) {
    std::array<char, 64> copy;
    if (word.size() > copy.size()) return std::nullopt;
    for (size_t i = 0; i < word.size(); ++i) {
        const bool exponent = (word[i] == 'D' || word[i] == 'd') && i > 0 && (is_digit(word[i - 1]) || word[i - 1] == '.' || word[i - 1] == ',');
        copy[i] = exponent ? 'e' : decimal_comma && word[i] == ',' ? '.' : word[i];
    }
    return parse_number(std::string_view(copy.data(), word.size()));
}

}  // namespace

void DialectFinder::add(std::string_view line) {
    size_t words = 0, commas = 0;
    bool in_word = false, points = false, decimal = true, others = false;
    char quote = 0;
    size_t commas_of_word = 0;
    for (size_t i = 0; i < line.size(); ++i) {
        const char c = line[i];
        const char before = i > 0 ? line[i - 1] : ' ', behind = i + 1 < line.size() ? line[i + 1] : ' ';
        if (is_quote(c) && (quote == 0 || c == quote)) {
            quote = quote ? 0 : c;
            quotes_ = true;
            others = true;
        }
        const bool between_quotes = c == ',' && quote == 0 && (is_quote(before) || is_quote(behind));
        if (is_blank(c) || c == ';' || between_quotes) {
            others = others || c == ';' || c == '\t';
            in_word = false;
            continue;
        }
        if (!in_word) ++words, commas_of_word = 0;
        in_word = true;
        points = points || (c == '.' && (is_digit(before) || is_digit(behind)));
        if (c != ',') continue;
        ++commas;
        decimal = decimal && ++commas_of_word == 1 && is_digit(behind) && !is_blank(before) && before != ',';
    }
    if (commas == 0) return;
    commas_ = true;
    decimal_ = decimal_ && decimal && !points && words >= (others ? size_t{2} : size_t{3});
}

size_t split_fields(std::string_view line, const TextDialect& dialect, std::span<std::string_view> words) {
    if (dialect.plain()) return split_numbers(line, words);
    size_t count = 0;
    for (size_t at = 0;;) {
        while (at < line.size() && is_blank(line[at])) ++at;
        if (at == line.size()) return count;
        size_t begin = at, end = at;
        const bool quoted = is_quote(line[at]) && line.find(line[at], at + 1) != std::string_view::npos;
        if (quoted) {
            begin = at + 1;
            end = line.find(line[at], begin);
            at = end + 1;
            while (begin < end && is_blank(line[begin])) ++begin;
            while (begin < end && is_blank(line[end - 1])) --end;
        } else {
            while (at < line.size() && !is_blank(line[at]) && line[at] != ';' && (dialect.decimal_comma || line[at] != ',')) ++at;
            end = at;
        }
        if (count < words.size()) words[count] = line.substr(begin, end - begin);
        ++count;
        while (at < line.size() && is_blank(line[at])) ++at;
        if (at < line.size() && (line[at] == ';' || (line[at] == ',' && (quoted || !dialect.decimal_comma)))) ++at;
    }
}

std::optional<double> parse_field(std::string_view word, const TextDialect& dialect) {
    if (const auto value = parse_number(word)) return value;
    return parse_rewritten(word, dialect.decimal_comma);
}

}  // namespace raypager
