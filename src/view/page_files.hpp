// The files of the page, which the build put into the program (cmake/EmbedKernels.cmake): no other file is ever served.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

namespace raypager {

struct PageFile {
    std::string_view name;  // "view.js"
    std::string_view text;
};
const std::vector<PageFile>& page_files();

// By name; "" is the page itself. Nothing if there is none.
const PageFile* find_page_file(std::string_view name);
// As browsers want to have it said.
const char* type_of_page_file(std::string_view name);

}  // namespace raypager
