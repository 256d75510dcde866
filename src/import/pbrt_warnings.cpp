#include "import/pbrt_warnings.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace raypager {
namespace {

constexpr size_t max_other_names = 3;

// Splits off what stands in quotes; returns the rest without its digits.
std::string kind_of_warning(const std::string& text, std::vector<std::string>& names) {
    std::string kind;
    bool inside = false;
    for (const char c : text) {
        if (c == '"') {
            inside = !inside;
            if (inside) names.emplace_back();
            kind += c;
        } else if (inside) {
            names.back() += c;
        } else if (c < '0' || c > '9') {
            kind += c;
        }
    }
    return kind;
}

}  // namespace

void PbrtWarnings::add(const PbrtLocation& location, const std::string& text) {
    std::vector<std::string> names;
    const auto [at, added] = by_kind_.try_emplace(kind_of_warning(text, names), entries_.size());
    if (added) entries_.push_back({location.with_line(), text, 0, {}});
    Entry& entry = entries_[at->second];
    ++entry.count;
    if (added || entry.others.size() > max_other_names) return;
    std::vector<std::string> first;
    kind_of_warning(entry.text, first);
    for (size_t i = 0; i < std::min(first.size(), names.size()); ++i)
        if (names[i] != first[i]) {
            if (std::find(entry.others.begin(), entry.others.end(), names[i]) == entry.others.end()) entry.others.push_back(names[i]);
            return;
        }
}

std::vector<std::string> PbrtWarnings::lines() const {
    std::vector<std::string> lines;
    for (const Entry& e : entries_) {
        std::string line = fmt::format("{}: {}", e.location, e.text);
        if (e.count > 1) line += fmt::format(" (and {} more of the same", e.count - 1);
        for (size_t i = 0; i < std::min(e.others.size(), max_other_names); ++i) line += fmt::format("{}\"{}\"", i == 0 ? ": " : ", ", e.others[i]);
        if (e.others.size() > max_other_names) line += ", ...";
        if (e.count > 1) line += ")";
        lines.push_back(line);
    }
    return lines;
}

}  // namespace raypager
