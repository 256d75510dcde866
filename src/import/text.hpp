// Small helpers for text formats.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace raypager {

inline bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f' || c == '\n'; }

// Words between blanks, views into text.
std::vector<std::string_view> split_words(std::string_view text);
// The first so many words of a line of numbers: separated by blanks, or by one comma or semicolon with blanks around it. Returns how many
// words there are in all.
size_t split_numbers(std::string_view text, std::span<std::string_view> words);
void split_words(std::string_view text, std::vector<std::string_view>& words);
// Without a carriage return at the end.
std::string_view trim_line_end(std::string_view line);
// Fit for a message: at most 40 characters of UTF-8, others and unprintable ones as "?".
std::string clipped(std::string_view text);

// What comes before the "#" of a comment.
std::string_view without_comment(std::string_view line);
// The name that follows the first word of a line, which may hold blanks, and a "#" as in "Material #25": that of a comment stands between blanks.
std::string_view name_behind_keyword(std::string_view line);

// As a double, whole word; with sign "+" too. "nan" and "inf" count, in Microsoft's spelling, too; so do Fortran's
// exponents (1.5D+03). What is too large for a double is infinite. Nothing if it is none.
std::optional<double> parse_number(std::string_view word);

}  // namespace raypager
