#include "view/request_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <random>

namespace raypager {
namespace {

std::string lower(std::string_view text) {
    std::string result(text);
    std::transform(result.begin(), result.end(), result.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return result;
}

bool is_name(std::string_view text) {
    return std::all_of(text.begin(), text.end(), [](unsigned char c) { return std::isalnum(c) || c == '.' || c == '-' || c == '_'; });
}

std::map<std::string, std::string> parse_query(std::string_view text) {
    std::map<std::string, std::string> query;
    while (!text.empty()) {
        const size_t end = std::min(text.find('&'), text.size());
        const std::string_view part = text.substr(0, end);
        const size_t equals = part.find('=');
        if (equals != std::string_view::npos) query.emplace(part.substr(0, equals), part.substr(equals + 1));
        text.remove_prefix(std::min(end + 1, text.size()));
    }
    return query;
}

}  // namespace

bool is_from_own_page(const RequestOrigin& from, uint16_t port) {
    if (!from.host) return false;
    const std::string host = lower(*from.host);
    const std::string behind = port == 80 ? "" : fmt::format(":{}", port);  // browsers leave the usual one out
    if (host != "127.0.0.1" + behind && host != "localhost" + behind) return false;
    if (from.origin && lower(*from.origin) != "http://" + host) return false;
    return !from.fetch_site || *from.fetch_site == "same-origin" || *from.fetch_site == "none";
}

bool same_token(std::string_view given, std::string_view token) {
    if (given.size() != token.size()) return false;
    unsigned char difference = 0;
    for (size_t i = 0; i < token.size(); i++) difference = static_cast<unsigned char>(difference | (given[i] ^ token[i]));
    return difference == 0;
}

std::string random_token() {
    std::random_device random;  // the system's own source
    std::string token;
    for (int i = 0; i < 4; i++) token += fmt::format("{:08x}", random());
    return token;
}

std::optional<Target> parse_target(std::string_view text) {
    if (text.empty() || text.front() != '/') return std::nullopt;
    text.remove_prefix(1);
    Target target;
    if (const size_t at = text.find('?'); at != std::string_view::npos) {
        target.query = parse_query(text.substr(at + 1));
        text = text.substr(0, at);
    }
    const size_t slash = text.find('/');
    if (slash == std::string_view::npos) return std::nullopt;
    target.token = text.substr(0, slash);
    target.name = text.substr(slash + 1);
    if (!is_name(target.token) || !is_name(target.name)) return std::nullopt;
    return target;
}

}  // namespace raypager
