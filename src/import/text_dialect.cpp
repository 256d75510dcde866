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
    size_t words = 0, commas = 0, commas_of_word = 0, within_quotes = 0;
    bool in_word = false, points = false, decimal = true, decimal_in_quotes = true, others = false, separating = false;
    char quote = 0;
    for (size_t i = 0; i < line.size(); ++i) {
        const char c = line[i], before = i > 0 ? line[i - 1] : ' ', behind = i + 1 < line.size() ? line[i + 1] : ' ';
        if (is_quote(c) && (quote ? c == quote : !in_word)) {
            quote = quote ? 0 : c;
            quotes_ = others = true;
        }
        const bool beside_quotes = c == ',' && quote == 0 && (is_quote(before) || is_quote(behind));
        separating = separating || beside_quotes;
        if (is_blank(c) || c == ';' || beside_quotes) {
            others = others || c == ';' || c == '\t';
            in_word = false;
            continue;
        }
        if (!in_word) ++words, commas_of_word = 0;
        in_word = true;
        points = points || (c == '.' && (is_digit(before) || is_digit(behind)));
        if (c != ',') continue;
        const bool good = ++commas_of_word == 1 && is_digit(behind) && !is_blank(before) && before != ',';
        ++commas;
        decimal = decimal && good;
        within_quotes += quote != 0;
        decimal_in_quotes = decimal_in_quotes && (good || quote == 0);
    }
    separating_ = separating_ || separating;
    if (separating ? within_quotes == 0 : commas == 0) return;
    const bool enough = separating || words >= (others ? size_t{2} : size_t{3});
    ++(!points && enough && (separating ? decimal_in_quotes : decimal) ? decimal_ : other_);
}

TextDialect DialectFinder::found() const {
    const bool decimal = decimal_ > 0 && decimal_ >= 9 * other_;
    return {.decimal_comma = decimal, .quotes = quotes_, .comma_separates = separating_ || !decimal};
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
            while (at < line.size() && !is_blank(line[at]) && line[at] != ';' && (!dialect.comma_separates || line[at] != ',')) ++at;
            end = at;
        }
        if (count < words.size()) words[count] = line.substr(begin, end - begin);
        ++count;
        while (at < line.size() && is_blank(line[at])) ++at;
        if (at < line.size() && (line[at] == ';' || (line[at] == ',' && (quoted || dialect.comma_separates)))) ++at;
    }
}

std::optional<double> parse_field(std::string_view word, const TextDialect& dialect) {
    if (const auto value = parse_number(word)) return value;
    return parse_rewritten(word, dialect.decimal_comma);
}

}  // namespace raypager
