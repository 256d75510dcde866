// The option --tune: changes to what the program chooses by the class of a device (device/profile.hpp).
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "cli/option_parser.hpp"
#include "raypager/device_profile.hpp"

namespace raypager {

// "NAME=VALUE,NAME=VALUE".
Result<ProfileChanges> parse_tuning(const std::string& text);
// {"NAME": VALUE, ...}, or null: nothing is changed.
nlohmann::ordered_json tuning_json(const ProfileChanges& tuning);
void add_tune_option(OptionParser& parser, ProfileChanges& tuning);

}  // namespace raypager
