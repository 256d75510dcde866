// Messages for the person at the terminal. One line each, on stderr.
#pragma once

#include <cstddef>
#include <string_view>

namespace raypager {

void log_warning(std::string_view message);
void log_note(std::string_view message);
bool stderr_is_terminal();
// What a line of progress may take: narrow terminals must not wrap it, for a wrapped line cannot be overwritten.
inline constexpr size_t progress_columns = 60;
// A line that the next one overwrites, cut off behind progress_columns characters on a terminal; an empty text ends it.
void progress_line(std::string_view text);

}  // namespace raypager
