// What a scene file has that is not taken as it stands, for the user to know.
#pragma once

#include <cstdint>
#include <string>
#include <unordered_map>
#include <vector>

#include "import/pbrt_tokens.hpp"

namespace raypager {

// One line per kind of warning: the place of the first, and how many more there were. Texts that differ only in numbers, or in what stands in
// quotes, are of one kind; so what comes from the file belongs in quotes.
class PbrtWarnings {
public:
    void add(const PbrtLocation& location, const std::string& text);
    std::vector<std::string> lines() const;

private:
    struct Entry {
        std::string location, text;
        uint64_t count = 0;
        std::vector<std::string> others;  // some of the names that later texts have in the first one's stead
    };
    std::vector<Entry> entries_;
    std::unordered_map<std::string, size_t> by_kind_;
};

}  // namespace raypager
