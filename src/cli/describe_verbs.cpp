#include "cli/describe_verbs.hpp"

#include <fmt/format.h>

#include <cstdio>

#include "cli/verbs.hpp"

namespace raypager {
namespace {

Status append_verb(const std::string& name, const Verb& verb, std::vector<DescribedVerb>& verbs) {
    auto description = describe_verb(verb.run);
    if (!description) return description.status().at(name);
    verbs.push_back({name, std::string(verb.about), std::move(*description)});
    return {};
}

}  // namespace

Result<std::vector<DescribedVerb>> describe_verbs() {
    std::vector<DescribedVerb> verbs;
    for (const Verb& verb : all_verbs()) {
        if (verb.name != "bench") {
            RAYPAGER_TRY(append_verb(std::string(verb.name), verb, verbs));
            continue;
        }
        for (const Verb& measurement : bench_measurements()) RAYPAGER_TRY(append_verb(fmt::format("bench {}", measurement.name), measurement, verbs));
    }
    return verbs;
}

// For the build, which installs what this prints; so it is not in the help.
Status run_generate(const Arguments& arguments) {
    const std::string what = arguments.size() == 1 ? arguments.front() : "";
    using Generator = std::string (*)(const std::vector<DescribedVerb>&);
    const Generator generator = what == "man"    ? man_page
                                : what == "bash" ? bash_completions
                                : what == "zsh"  ? zsh_completions
                                : what == "fish" ? fish_completions
                                                 : nullptr;
    if (!generator) return Status::usage("generate: takes one word: man, bash, zsh or fish");
    const auto verbs = describe_verbs();
    if (!verbs) return verbs.status();
    std::fputs(generator(*verbs).c_str(), stdout);
    return {};
}

}  // namespace raypager
