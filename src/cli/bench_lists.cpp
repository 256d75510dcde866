#include "cli/bench_lists.hpp"

#include "cli/values.hpp"

namespace raypager {

std::vector<std::string> split_list(const std::string& text) {
    std::vector<std::string> pieces(1);
    for (const char c : text) {
        if (c == ',')
            pieces.emplace_back();
        else
            pieces.back() += c;
    }
    return pieces;
}

std::vector<PolicyKind> all_policies() {
    std::vector<PolicyKind> kinds;
    for (const PolicyName& policy : policy_names) kinds.push_back(policy.kind);
    return kinds;
}

OptionParser::Setter into_policies(std::vector<PolicyKind>& target) {
    return [&target](const std::string& text) -> Status {
        if (text != "all") return into_list(target, [](const std::string& name) { return parse_policy(name); })(text);
        target = all_policies();
        return {};
    };
}

}  // namespace raypager
