// The error that says what is wrong with a section of a block file.
#pragma once

#include <string>

#include "raypager/status.hpp"
#include "store/format.hpp"

namespace raypager {

Status bad_section(format::Section section, const std::string& what);

}  // namespace raypager
