// Names of the paging policies, as on the command line and in reports.
#pragma once

#include <array>
#include <optional>
#include <string_view>

namespace raypager {

enum class PolicyKind {
    aged_wants,       // load: wants x (age of the oldest want)^(1/4) / bytes; evict: what the fewest rays enter
    most_wanted,      // the paper, 3.5: load the most wanted; evict the least bounced of the last round
    wanted_per_byte,  // load: wants / bytes; evict: least recently used
    lru,              // on demand: load the block wanted for longest, at once; evict: least recently used
    sweep             // blind: load every block in turn, whatever is wanted; evict: the one that has been there for longest
};

struct PolicyName {
    PolicyKind kind;
    std::string_view name;
};
inline constexpr std::array<PolicyName, 5> policy_names = {{{PolicyKind::aged_wants, "aged-wants"},
                                                            {PolicyKind::most_wanted, "most-wanted"},
                                                            {PolicyKind::wanted_per_byte, "wanted-per-byte"},
                                                            {PolicyKind::lru, "lru"},
                                                            {PolicyKind::sweep, "sweep"}}};

constexpr std::string_view policy_name(PolicyKind kind) {
    for (const PolicyName& entry : policy_names)
        if (entry.kind == kind) return entry.name;
    return "?";
}

constexpr std::optional<PolicyKind> policy_from_name(std::string_view name) {
    for (const PolicyName& entry : policy_names)
        if (entry.name == name) return entry.kind;
    return std::nullopt;
}

// Where the pool lies. host is a baseline for measurements, not a mode to render in: geometry in host memory that the device has mapped
// and reads across the bus, without any paging. The pool then holds all blocks and does not count as device memory.
enum class PoolPlace { device, host };

}  // namespace raypager
