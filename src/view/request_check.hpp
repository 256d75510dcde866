// Which requests the page's own browser makes, and which come from elsewhere: none of the latter is answered.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>

namespace raypager {

// What a request says of where it comes from. Headers that are not there are nothing.
struct RequestOrigin {
    std::optional<std::string> host, origin, fetch_site;
};

// Host must name this server by address or as localhost, with its port: another name may have been pointed at this address. Origin, where there is
// one, must be that of the page itself; a browser that says so (Sec-Fetch-Site) must not have been sent here by another site.
bool is_from_own_page(const RequestOrigin& from, uint16_t port);

// In a time that does not tell how much of it was right.
bool same_token(std::string_view given, std::string_view token);
// 32 hexadecimal digits that nobody can guess.
std::string random_token();

// "/TOKEN/name?key=value&..." in its parts.
struct Target {
    std::string token, name;
    std::map<std::string, std::string> query;  // values as they stand: nothing that is asked for here needs an escape
};
// Nothing if it is not made like this. A name has letters, digits, dots, dashes and underscores alone, so there is no path in it.
std::optional<Target> parse_target(std::string_view target);

}  // namespace raypager
