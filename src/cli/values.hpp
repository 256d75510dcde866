// Texts of the command line -> values, and values -> texts for people. Errors are usage errors that say what was expected; who calls
// knows the option and puts its name in front.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

#include "base/numbers.hpp"
#include "base/words.hpp"
#include "raypager/scene.hpp"
#include "raypager/session.hpp"
#include "raypager/status.hpp"

namespace raypager {

// Names of the engine's choices.
Result<PolicyKind> parse_policy(std::string_view text);
Result<Connection> parse_connection(std::string_view text);

struct ImageSize {
    uint32_t width = 0, height = 0;
};
// "1280x720"; each side from 1 to 2^20, together at most 2^28 pixels, which is what picture files are read up to.
Result<ImageSize> parse_image_size(std::string_view text);

// auto, ray or stream.
Result<Traversal> parse_traversal(const std::string& text);
// "x,y,z,X,Y,Z": two corners of a box.
Result<std::pair<Float3, Float3>> parse_box(const std::string& text);

}  // namespace raypager
