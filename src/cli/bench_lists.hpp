// Options of measurements that take lists: "100%,50%,25%".
#pragma once

#include <string>
#include <vector>

#include "cli/option_parser.hpp"
#include "raypager/tuning.hpp"

namespace raypager {

// Pieces between commas; an empty text is one empty piece.
std::vector<std::string> split_list(const std::string& text);

std::vector<PolicyKind> all_policies();
OptionParser::Setter into_policies(std::vector<PolicyKind>& target);  // names, or "all"

// Parses each piece; the list replaces the default.
template <class Item, class Parse>
OptionParser::Setter into_list(std::vector<Item>& target, Parse parse) {
    return [&target, parse = std::move(parse)](const std::string& text) -> Status {
        std::vector<Item> items;
        for (const std::string& piece : split_list(text)) {
            auto item = parse(piece);
            if (!item) return item.status();
            items.push_back(static_cast<Item>(std::move(*item)));
        }
        target = std::move(items);
        return {};
    };
}

}  // namespace raypager
