// Messages for the person at the terminal. One line each, on stderr.
#pragma once

#include <string_view>

namespace raypager {

void log_warning(std::string_view message);
void log_note(std::string_view message);
bool stderr_is_terminal();
// A line that the next one overwrites; an empty text ends it.
void progress_line(std::string_view text);

}  // namespace raypager
