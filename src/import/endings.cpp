#include "import/endings.hpp"

#include <algorithm>

namespace raypager {
namespace {

std::string small_letters(std::string text) {
    std::transform(text.begin(), text.end(), text.begin(), [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
    return text;
}

}  // namespace

std::string format_ending(const std::filesystem::path& path) {
    const std::string ending = small_letters(path.extension().string());
    return ending == ".gz" ? small_letters(path.stem().extension().string()) : ending;
}

}  // namespace raypager
