// Figures as people read them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace raypager {

std::string format_bytes(uint64_t bytes);        // "12.3 MiB"
std::string format_exact_bytes(uint64_t bytes);  // "12897485 bytes (12.3 MiB)": for limits that are to be typed back
std::string format_count(uint64_t count);        // "1,234,567"
std::string format_share(double share);          // "12.3 %"; never 0.0 % of something that there is
std::string format_duration(double seconds);     // "0.42 s", "12.3 s", "4:05", "1:02:03"
// "1 triangle", "1,234 triangles". plural: where it is not the noun with an s.
std::string counted(uint64_t count, std::string_view noun, std::string_view plural = {});

// The text, or its beginning and "..." if it has more characters than that.
std::string shortened(std::string_view text, size_t most);

}  // namespace raypager
