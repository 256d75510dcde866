// What a glTF file has that is not taken as it stands, for the user to know: one line for each kind.
#pragma once

#include <fmt/format.h>

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace raypager {

class GltfNotes {
public:
    explicit GltfNotes(std::string file) : file_(std::move(file)) {}
    // text: of the first of its kind. place: where, such as "material 3".
    void add(const std::string& kind, const std::string& place, const std::string& text) {
        const auto [at, added] = by_kind_.try_emplace(kind, entries_.size());
        if (added) entries_.push_back({place + ": " + text, 0});
        ++entries_[at->second].count;
    }
    void add_to(std::vector<std::string>& warnings) const {
        for (const Entry& entry : entries_)
            warnings.push_back(fmt::format("{}: {}{}", file_, entry.text, entry.count > 1 ? fmt::format(" (and {} more)", entry.count - 1) : ""));
    }

private:
    struct Entry {
        std::string text;
        uint64_t count = 0;
    };
    std::string file_;
    std::vector<Entry> entries_;
    std::map<std::string, size_t> by_kind_;
};

}  // namespace raypager
