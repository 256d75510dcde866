// Numbers and sizes as people write them -> values. Errors are usage errors that say what was expected; who calls knows what was asked for and puts
// its name in front.
#pragma once

#include <cstdint>
#include <string_view>

#include "raypager/status.hpp"

namespace raypager {

// Bytes: a positive number with a unit or without, as people write them: "4M", "1.5g", "8GB", "8 GiB", "512kb", "65536", "4096 bytes". Units are
// binary whatever their spelling.
Result<uint64_t> parse_size(std::string_view text);

struct SizeOrPercent {
    uint64_t bytes = 0;  // 0: given as a percentage
    double percent = 0;  // 0: given in bytes; otherwise over 0 and at most 100
};
Result<SizeOrPercent> parse_size_or_percent(std::string_view text);

Result<double> parse_share(std::string_view text);  // "15%" -> 0.15; from 0% to 100%

// How many: a whole number from lowest to highest. With K, M or G behind it: thousands, millions, billions ("2.5M" is 2500000). Its thousands may be
// parted: "1,000,000", "1_000_000".
Result<uint64_t> parse_count(std::string_view text, uint64_t lowest, uint64_t highest);
// A number over 0, in seconds.
Result<double> parse_seconds(std::string_view text);

// Any number that is finite.
Result<double> parse_finite(std::string_view text);
// A number over 0 that a float holds.
Result<double> parse_positive(std::string_view text);

}  // namespace raypager
