#include "import/point_columns.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "import/text.hpp"

namespace raypager {
namespace {

struct ColumnName {
    std::string_view name;  // in small letters and digits alone
    PointColumn column;
};

constexpr ColumnName column_names[] = {
    {"x", PointColumn::x},
    {"xcoord", PointColumn::x},
    {"xcoordinate", PointColumn::x},
    {"coordx", PointColumn::x},
    {"posx", PointColumn::x},
    {"px", PointColumn::x},
    {"pointx", PointColumn::x},
    {"easting", PointColumn::x},
    {"east", PointColumn::x},
    {"e", PointColumn::x},
    {"longitude", PointColumn::x},
    {"lon", PointColumn::x},
    {"long", PointColumn::x},
    {"lng", PointColumn::x},
    {"y", PointColumn::y},
    {"ycoord", PointColumn::y},
    {"ycoordinate", PointColumn::y},
    {"coordy", PointColumn::y},
    {"posy", PointColumn::y},
    {"py", PointColumn::y},
    {"pointy", PointColumn::y},
    {"northing", PointColumn::y},
    {"north", PointColumn::y},
    {"n", PointColumn::y},
    {"latitude", PointColumn::y},
    {"lat", PointColumn::y},
    {"z", PointColumn::z},
    {"zcoord", PointColumn::z},
    {"zcoordinate", PointColumn::z},
    {"coordz", PointColumn::z},
    {"posz", PointColumn::z},
    {"pz", PointColumn::z},
    {"pointz", PointColumn::z},
    {"elevation", PointColumn::z},
    {"elev", PointColumn::z},
    {"height", PointColumn::z},
    {"h", PointColumn::z},
    {"altitude", PointColumn::z},
    {"alt", PointColumn::z},
    {"intensity", PointColumn::intensity},
    {"i", PointColumn::intensity},
    {"int", PointColumn::intensity},
    {"reflectance", PointColumn::intensity},
    {"reflectivity", PointColumn::intensity},
    {"refl", PointColumn::intensity},
    {"amplitude", PointColumn::intensity},
    {"remission", PointColumn::intensity},
    {"grey", PointColumn::intensity},
    {"gray", PointColumn::intensity},
    {"red", PointColumn::red},
    {"r", PointColumn::red},
    {"rf", PointColumn::red},
    {"diffusered", PointColumn::red},
    {"colorr", PointColumn::red},
    {"colorred", PointColumn::red},
    {"green", PointColumn::green},
    {"g", PointColumn::green},
    {"gf", PointColumn::green},
    {"diffusegreen", PointColumn::green},
    {"colorg", PointColumn::green},
    {"colorgreen", PointColumn::green},
    {"blue", PointColumn::blue},
    {"b", PointColumn::blue},
    {"bf", PointColumn::blue},
    {"diffuseblue", PointColumn::blue},
    {"colorb", PointColumn::blue},
    {"colorblue", PointColumn::blue},
    {"class", PointColumn::classification},
    {"classification", PointColumn::classification},
    {"radius", PointColumn::radius},
    {"pointradius", PointColumn::radius},
};

constexpr std::string_view skipped_names[] = {"a",
                                              "alpha",
                                              "opacity",
                                              "af",
                                              "nx",
                                              "ny",
                                              "nz",
                                              "normalx",
                                              "normaly",
                                              "normalz",
                                              "nxf",
                                              "label",
                                              "labels",
                                              "cls",
                                              "category",
                                              "semantic",
                                              "id",
                                              "pointid",
                                              "index",
                                              "instance",
                                              "time",
                                              "gpstime",
                                              "timestamp",
                                              "t",
                                              "return",
                                              "returnnumber",
                                              "returnno",
                                              "rn",
                                              "numberofreturns",
                                              "returns",
                                              "nr",
                                              "numreturns",
                                              "returncount",
                                              "scanangle",
                                              "scananglerank",
                                              "angle",
                                              "userdata",
                                              "pointsourceid",
                                              "pointsource",
                                              "edgeofflightline",
                                              "scandirectionflag",
                                              "scandirection",
                                              "ring",
                                              "row",
                                              "col",
                                              "column",
                                              "range",
                                              "distance",
                                              "confidence",
                                              "quality",
                                              "curvature",
                                              "scannerchannel",
                                              "nir",
                                              "infrared",
                                              "unused",
                                              "skip",
                                              "deviation",
                                              "pulsewidth"};

// In small letters and digits alone, without a unit behind it and without what says that it is a coordinate or a scalar field:
// "//X", "Easting [m]", "scalar_Intensity".
std::string bare_name(std::string_view name) {
    std::string bare;
    for (const char c : name.substr(0, name.find_first_of("([", 1))) {
        if (c >= 'A' && c <= 'Z') bare += static_cast<char>(c - 'A' + 'a');
        if ((c >= 'a' && c <= 'z') || (c >= '0' && c <= '9')) bare += c;
    }
    if (bare.starts_with("scalar") && bare.size() > 6) bare.erase(0, 6);
    return bare;
}

constexpr std::string_view short_names[] = {"_", "x", "y", "z", "i", "r", "g", "b", "class", "radius"};

}  // namespace

std::optional<PointColumn> find_point_column(std::string_view name) {
    if (name == "_" || name == "-") return PointColumn::skip;
    const std::string bare = bare_name(name);
    for (const ColumnName& known : column_names)
        if (known.name == bare) return known.column;
    if (std::find(std::begin(skipped_names), std::end(skipped_names), bare) != std::end(skipped_names)) return PointColumn::skip;
    return std::nullopt;
}

bool is_geographic_name(std::string_view name) {
    const std::string bare = bare_name(name);
    return bare == "lon" || bare == "long" || bare == "lng" || bare == "longitude" || bare == "lat" || bare == "latitude";
}

bool have_position(const PointColumns& columns) {
    const auto has = [&](PointColumn column) { return std::find(columns.begin(), columns.end(), column) != columns.end(); };
    return has(PointColumn::x) && has(PointColumn::y) && has(PointColumn::z);
}

Result<PointColumns> parse_point_columns(const std::string& list) {
    PointColumns columns;
    const auto count = [&](PointColumn column) { return std::count(columns.begin(), columns.end(), column); };
    for (size_t at = 0; at <= list.size();) {
        const size_t comma = std::min(list.find_first_of(", ;", at), list.size());
        const std::string name = list.substr(at, comma - at);
        at = comma + 1;
        const auto column = find_point_column(name);
        if (!column)
            return Status::usage(fmt::format("'{}' is no column; there are x y z i r g b class radius, and _ for what is to be passed over", name));
        columns.push_back(*column);
        if (*column != PointColumn::skip && count(*column) > 1) return Status::usage(fmt::format("'{}': {} is there twice", list, name));
    }
    if (!have_position(columns)) return Status::usage(fmt::format("'{}': x, y and z must all be there", list));
    const auto colors = count(PointColumn::red) + count(PointColumn::green) + count(PointColumn::blue);
    if (colors % 3 != 0) return Status::usage(fmt::format("'{}': of r, g and b, all must be there or none", list));
    return columns;
}

std::string point_column_list(const PointColumns& columns) {
    std::string list;
    for (const PointColumn column : columns) {
        if (!list.empty()) list += ',';
        list += short_names[static_cast<size_t>(column)];
    }
    return list;
}

}  // namespace raypager
