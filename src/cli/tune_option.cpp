#include "cli/tune_option.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "cli/bench_lists.hpp"
#include "cli/values.hpp"
#include "raypager/report.hpp"

namespace raypager {
namespace {

Result<double> parse_value(const ProfileField& field, const std::string& text) {
    if (field.unit == ProfileField::Unit::count) {
        const auto count = parse_count(text, static_cast<uint64_t>(field.lowest), static_cast<uint64_t>(field.highest));
        return count ? Result<double>(static_cast<double>(*count)) : count.status();
    }
    if (field.unit == ProfileField::Unit::bytes) {
        if (text == "0") return 0.0;
        const auto bytes = parse_size(text);
        if (!bytes) return bytes.status();
        if (static_cast<double>(*bytes) <= field.highest) return static_cast<double>(*bytes);
        return Status::usage(fmt::format("'{}' is more than {}", text, format_bytes(static_cast<uint64_t>(field.highest))));
    }
    const auto number = parse_finite(text);
    if (number && *number >= field.lowest && *number <= field.highest) return *number;
    return Status::usage(fmt::format("'{}' is not a number from {} to {}", text, field.lowest, field.highest));
}

}  // namespace

Result<ProfileChanges> parse_tuning(const std::string& text) {
    ProfileChanges changes;
    for (const std::string& piece : split_list(text)) {
        const size_t equals = piece.find('=');
        if (equals == std::string::npos) return Status::usage(fmt::format("'{}' is not NAME=VALUE", piece));
        const std::string name = piece.substr(0, equals);
        const ProfileField* field = find_profile_field(name);
        if (!field) return Status::usage(fmt::format("there is no '{}'; 'raypager devices --profile' lists what can be set", name));
        if (std::ranges::any_of(changes, [field](const ProfileChange& change) { return change.field == field; }))
            return Status::usage(fmt::format("{} is given more than once", name));
        const auto value = parse_value(*field, piece.substr(equals + 1));
        if (!value) return value.status().at(name);
        changes.push_back({field, *value});
    }
    return changes;
}

nlohmann::ordered_json tuning_json(const ProfileChanges& tuning) { return nlohmann::ordered_json::parse(tuning_text(tuning)); }

void add_tune_option(OptionParser& parser, ProfileChanges& tuning) {
    parser.option("tune", "NAME=VALUE,...", "change what is chosen by the kind of device; 'raypager devices --profile' lists the names and values",
                  into(tuning, parse_tuning));
}

}  // namespace raypager
