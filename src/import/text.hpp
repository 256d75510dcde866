// Small helpers for text formats.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace raypager {

// Words between blanks, views into text.
std::vector<std::string_view> split_words(std::string_view text);
void split_words(std::string_view text, std::vector<std::string_view>& words);
// Without a carriage return at the end.
std::string_view trim_line_end(std::string_view line);
// Fit for a message: at most 40 characters, unprintable ones as '?'.
std::string clipped(std::string_view text);

enum class NumberKind { none, finite, not_finite };
// What a word is as a decimal number: "nan", "inf" and what a float cannot hold are not finite.
NumberKind classify_number(std::string_view word);

}  // namespace raypager
