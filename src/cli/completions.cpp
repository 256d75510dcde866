// Completions of verbs, options and file names for bash, zsh and fish.
#include <fmt/format.h>

#include <algorithm>
#include <string_view>

#include "cli/describe_verbs.hpp"

namespace raypager {
namespace {

constexpr std::string_view bench = "bench ";

bool is_measurement(const DescribedVerb& verb) { return verb.name.starts_with(bench); }
std::string last_word(const DescribedVerb& verb) { return is_measurement(verb) ? verb.name.substr(bench.size()) : verb.name; }

// What stands behind "raypager" and behind "raypager bench"; summaries beside them, for shells that show these.
struct Words {
    std::vector<std::pair<std::string, std::string>> first, measurements;
};

Words words_of(const std::vector<DescribedVerb>& verbs) {
    Words words;
    for (const DescribedVerb& verb : verbs) (is_measurement(verb) ? words.measurements : words.first).emplace_back(last_word(verb), verb.summary);
    words.first.emplace_back("bench", "measure the program itself");
    words.first.emplace_back("help", "show the options of a verb");
    return words;
}

std::string names(const std::vector<std::pair<std::string, std::string>>& words) {
    std::string text;
    for (const auto& [name, summary] : words) text += (text.empty() ? "" : " ") + name;
    return text;
}

// Options that take the name of a file or folder say so by that of their value.
bool takes_path(const OptionDescription& option) { return option.value.starts_with("FILE") || option.value == "DIR"; }

// The beginning of a help text: a line's worth of it.
std::string short_help(const std::string& help) {
    std::string text = help.substr(0, std::min({help.find("; "), help.find(": "), help.find(" (default"), help.find(". ")}));
    constexpr size_t most = 72;
    if (text.size() > most) text = text.substr(0, text.rfind(' ', most)) + " ...";
    return text;
}

// In single quotes, as all three shells read them; escaped: characters that get a backslash besides.
std::string escaped(const std::string& text, std::string_view characters) {
    std::string result;
    for (const char c : text) {
        if (characters.find(c) != std::string_view::npos) result += '\\';
        result += c;
    }
    return result;
}
std::string shell_quoted(const std::string& text) {
    std::string result = "'";
    for (const char c : text) result += c == '\'' ? "'\\''" : std::string(1, c);
    return result + "'";
}
std::string fish_quoted(const std::string& text) { return "'" + escaped(text, "'\\") + "'"; }

std::string bash_case(const DescribedVerb& verb) {
    std::string options, paths, values;
    for (const OptionDescription& option : verb.description.options) {
        options += (options.empty() ? "--" : " --") + option.name;
        std::string& target = takes_path(option) ? paths : values;
        if (option.value.empty()) continue;
        target += fmt::format(" --{}", option.name);
        if (!option.letter.empty()) target += fmt::format(" -{}", option.letter);
    }
    return fmt::format("        {})\n            options='{}'\n            paths='{} '\n            values='{} '\n            ;;\n",
                       shell_quoted(verb.name), options, paths, values);
}

std::string zsh_option(const OptionDescription& option) {
    std::string text = fmt::format("[{}]", escaped(short_help(option.help), "[]:\\"));
    if (!option.value.empty()) text += fmt::format(":{}:{}", escaped(option.value, "[]:\\"), takes_path(option) ? "_files" : " ");
    if (option.letter.empty()) return fmt::format("            {}", shell_quoted(fmt::format("--{}{}", option.name, text)));
    return fmt::format("            '(-{0} --{1})'{{-{0},--{1}}}{2}", option.letter, option.name, shell_quoted(text));
}

std::string zsh_case(const DescribedVerb& verb) {
    std::string text = fmt::format("    {})\n        _arguments -s \\\n", shell_quoted(verb.name));
    for (const OptionDescription& option : verb.description.options) text += zsh_option(option) + " \\\n";
    return text + (verb.description.takes_inputs ? "            '*:input:_files'\n        ;;\n" : "            && return 0\n        ;;\n");
}

std::string zsh_list(const char* variable, const std::vector<std::pair<std::string, std::string>>& words) {
    std::string text = fmt::format("    {}=(\n", variable);
    for (const auto& [name, summary] : words) text += fmt::format("        {}\n", shell_quoted(fmt::format("{}:{}", name, summary)));
    return text + "    )\n";
}

}  // namespace

std::string bash_completions(const std::vector<DescribedVerb>& verbs) {
    const Words words = words_of(verbs);
    std::string text = fmt::format(
        "# bash completion for raypager\n"
        "_raypager() {{\n"
        "    local current=${{COMP_WORDS[COMP_CWORD]}} previous=${{COMP_WORDS[COMP_CWORD-1]}} verb=${{COMP_WORDS[1]}}\n"
        "    local options='' paths='' values='' verbs='{}' measurements='{}'\n"
        "    COMPREPLY=()\n"
        "    if [[ $COMP_CWORD -eq 1 || ( $COMP_CWORD -eq 2 && $verb == help ) ]]; then\n"
        "        COMPREPLY=($(compgen -W \"$verbs --help --version\" -- \"$current\"))\n"
        "        return\n"
        "    fi\n"
        "    if [[ $verb == bench ]]; then\n"
        "        if [[ $COMP_CWORD -eq 2 ]]; then\n"
        "            COMPREPLY=($(compgen -W \"$measurements\" -- \"$current\"))\n"
        "            return\n"
        "        fi\n"
        "        verb=\"bench ${{COMP_WORDS[2]}}\"\n"
        "    fi\n"
        "    case $verb in\n",
        names(words.first), names(words.measurements));
    for (const DescribedVerb& verb : verbs) text += bash_case(verb);
    // With no answer of ours, readline completes file names.
    return text +
           "    esac\n"
           "    if [[ $values == *\" $previous \"* ]]; then\n"
           "        compopt +o default\n"
           "    elif [[ $current == -* && $paths != *\" $previous \"* ]]; then\n"
           "        COMPREPLY=($(compgen -W \"$options\" -- \"$current\"))\n"
           "    fi\n"
           "}\n"
           "complete -o default -F _raypager raypager\n";
}

std::string zsh_completions(const std::vector<DescribedVerb>& verbs) {
    const Words words = words_of(verbs);
    std::string text = "#compdef raypager\n\n_raypager() {\n    local -a verbs measurements\n    local verb=$words[2]\n" +
                       zsh_list("verbs", words.first) + zsh_list("measurements", words.measurements) +
                       "    if (( CURRENT == 2 )) || [[ $CURRENT -eq 3 && $verb == help ]]; then\n"
                       "        _describe -t verbs verb verbs\n"
                       "        return\n"
                       "    fi\n"
                       "    if [[ $verb == bench ]]; then\n"
                       "        if (( CURRENT == 3 )); then\n"
                       "            _describe -t measurements measurement measurements\n"
                       "            return\n"
                       "        fi\n"
                       "        verb=\"bench $words[3]\"\n"
                       "        shift words\n"
                       "        (( CURRENT-- ))\n"
                       "    fi\n"
                       "    shift words\n"
                       "    (( CURRENT-- ))\n"
                       "    case $verb in\n";
    for (const DescribedVerb& verb : verbs) text += zsh_case(verb);
    return text + "    esac\n}\n\n_raypager \"$@\"\n";
}

std::string fish_completions(const std::vector<DescribedVerb>& verbs) {
    const Words words = words_of(verbs);
    std::string text = "# fish completions for raypager\n";
    for (const auto& [name, summary] : words.first)
        text += fmt::format("complete -c raypager -n __fish_use_subcommand -f -a {} -d {}\n", name, fish_quoted(summary));
    for (const auto& [name, summary] : words.measurements)
        text += fmt::format("complete -c raypager -n '__fish_seen_subcommand_from bench; and not __fish_seen_subcommand_from {}' -f -a {} -d {}\n",
                            names(words.measurements), name, fish_quoted(summary));
    for (const DescribedVerb& verb : verbs) {
        const std::string condition =
            fmt::format("{}__fish_seen_subcommand_from {}", is_measurement(verb) ? "__fish_seen_subcommand_from bench; and " : "", last_word(verb));
        for (const OptionDescription& option : verb.description.options) {
            text += fmt::format("complete -c raypager -n '{}' -l {}", condition, option.name);
            if (!option.letter.empty()) text += " -s " + option.letter;
            if (!option.value.empty()) text += takes_path(option) ? " -r" : " -x";
            text += " -d " + fish_quoted(short_help(option.help)) + "\n";
        }
    }
    return text;
}

}  // namespace raypager
