// The blocks of a scene, as the page draws them over its picture.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "raypager/blocks.hpp"
#include "raypager/session.hpp"

namespace raypager {

inline constexpr size_t most_blocks_shown = 4096;

// Of those in the world itself, not of objects, which stand in many places at once: the ones to show, at most `most`. Where there are more, those
// that rays wait for come first, then those on their way, then those that are largest as seen from the eye.
std::vector<uint32_t> blocks_to_show(const Blocks& scene, std::span<const BlockStatus> status, const std::array<float, 3>& eye, size_t most);

// A record of 32 bytes for each: lower and upper corner (six 32-bit floats), BlockStatus::State, rays that wait (32-bit integers), least significant
// byte first.
std::string block_records(const Blocks& scene, std::span<const BlockStatus> status, std::span<const uint32_t> shown);

}  // namespace raypager
