// All verbs with their options, as data: what the manual page and the completions of shells are made of, so that they cannot say anything else than
// the help.
#pragma once

#include <string>
#include <vector>

#include "cli/option_parser.hpp"

namespace raypager {

struct DescribedVerb {
    std::string name, summary;  // "bench sweep"; a few words
    VerbDescription description;
};

// In the order of the help, a verb's measurements as verbs of their own.
Result<std::vector<DescribedVerb>> describe_verbs();

// The manual page, for man(1).
std::string man_page(const std::vector<DescribedVerb>& verbs);

// Completions, as each shell reads them from a file.
std::string bash_completions(const std::vector<DescribedVerb>& verbs);
std::string zsh_completions(const std::vector<DescribedVerb>& verbs);
std::string fish_completions(const std::vector<DescribedVerb>& verbs);

}  // namespace raypager
