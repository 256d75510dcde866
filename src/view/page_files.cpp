#include "view/page_files.hpp"

#include <algorithm>

namespace raypager {

const PageFile* find_page_file(std::string_view name) {
    if (name.empty()) name = "index.html";
    const auto& files = page_files();
    const auto found = std::find_if(files.begin(), files.end(), [&](const PageFile& file) { return file.name == name; });
    return found == files.end() ? nullptr : &*found;
}

const char* type_of_page_file(std::string_view name) {
    if (name.ends_with(".js")) return "text/javascript; charset=utf-8";
    if (name.ends_with(".css")) return "text/css; charset=utf-8";
    return "text/html; charset=utf-8";
}

}  // namespace raypager
