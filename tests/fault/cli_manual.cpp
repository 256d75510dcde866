// The manual page and the completions that the program prints: they name whatever the help names, and their readers take them without a word.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "support/temporary_folder.hpp"

namespace raypager {
namespace {

using support::read_file;

const std::string generated[] = {"man", "bash", "zsh", "fish"};

class CliManual : public testing::Test {
protected:
    // A shell command in a folder of its own, with the program as "$raypager"; what it printed, errors behind it. It must succeed.
    std::string run(const std::string& command) const {
        const std::string line =
            fmt::format("cd '{}' && raypager='{}' && {{ {}\n}} >out 2>&1 </dev/null", folder_.path().string(), RAYPAGER_PROGRAM, command);
        const int raw = std::system(line.c_str());
        EXPECT_TRUE(WIFEXITED(raw) && WEXITSTATUS(raw) == 0) << command << "\n" << read_file(folder_ / "out");
        return read_file(folder_ / "out");
    }
    static bool installed(const char* program) { return std::system(fmt::format("command -v {} >/dev/null 2>&1", program).c_str()) == 0; }

    // As the help of a verb lists them.
    std::set<std::string> options_in(const std::string& help) const {
        std::set<std::string> names;
        static const std::regex option("^ +(?:-[a-z] \\[ )?--([a-z-]+)");
        std::istringstream lines(help);
        std::smatch match;
        for (std::string line; std::getline(lines, line);)
            if (std::regex_search(line, match, option)) names.insert(match[1]);
        return names;
    }
    // Verbs, or measurements, as the help lists them.
    std::vector<std::string> words_in(const std::string& help) const {
        std::vector<std::string> words;
        static const std::regex word("^  ([a-z-]+) +[a-z]");
        std::istringstream lines(help);
        std::smatch match;
        for (std::string line; std::getline(lines, line);)
            if (std::regex_search(line, match, word)) words.push_back(match[1]);
        return words;
    }

    const support::TemporaryFolder folder_;
};

TEST_F(CliManual, NamesEveryVerbAndOption) {
    std::map<std::string, std::string> texts;
    for (const auto& kind : generated) texts[kind] = run("\"$raypager\" generate " + kind);
    std::vector<std::string> verbs = words_in(run("\"$raypager\" help"));
    ASSERT_GE(verbs.size(), 7u);
    const auto measurements = words_in(run("\"$raypager\" help bench"));
    ASSERT_GE(measurements.size(), 4u);
    std::erase(verbs, "bench");
    for (const auto& measurement : measurements) verbs.push_back("bench " + measurement);
    size_t options = 0;
    for (const auto& verb : verbs) {
        EXPECT_NE(texts["bash"].find(fmt::format("        '{}')", verb)), std::string::npos) << verb;
        EXPECT_NE(texts["zsh"].find(fmt::format("    '{}')", verb)), std::string::npos) << verb;
        const auto escaped = std::regex_replace(verb, std::regex("-"), "\\-");
        EXPECT_NE(texts["man"].find(".SS " + escaped), std::string::npos) << verb;
        for (const auto& option : options_in(run("\"$raypager\" help " + verb))) {
            options++;
            for (const auto& [kind, text] : texts) {
                const std::string dashed = kind == "fish" ? "-l " + option : "--" + option;
                EXPECT_NE(text.find(kind == "man" ? std::regex_replace(dashed, std::regex("-"), "\\-") : dashed), std::string::npos)
                    << kind << " lacks --" << option << " of " << verb;
            }
        }
    }
    EXPECT_GT(options, 80u) << "the help was misread";
}

TEST_F(CliManual, TroffHasNothingToSayAboutThePage) {
    if (!installed("man") || !installed("groff")) GTEST_SKIP() << "man-db and groff are not installed";
    EXPECT_EQ(run("\"$raypager\" generate man >raypager.1 && LC_ALL=C.UTF-8 MANWIDTH=80 man --warnings=all -E UTF-8 -l raypager.1 >text"), "");
    const std::string text = read_file(folder_ / "text");
    EXPECT_NE(text.find("--geometry-limit SIZE|%"), std::string::npos) << text.substr(0, 2000);
    EXPECT_NE(text.find("RAYPAGER_DEVICE"), std::string::npos);
}

TEST_F(CliManual, BashCompletesVerbsOptionsAndNothingElse) {
    if (!installed("bash")) GTEST_SKIP() << "bash is not installed";
    run("\"$raypager\" generate bash >completions");
    const auto complete = [&](const std::string& words) {
        return run(
            fmt::format("bash -c 'source ./completions; compopt() {{ echo \"compopt $*\"; }}; COMP_WORDS=(raypager {}); "
                        "COMP_CWORD=$((${{#COMP_WORDS[@]}} - 1)); _raypager; echo ${{COMPREPLY[@]}}'",
                        words));
    };
    EXPECT_EQ(complete("ren"), "render\n");
    EXPECT_EQ(complete("help com"), "compare\n");
    EXPECT_EQ(complete("bench sw"), "sweep\n");
    EXPECT_EQ(complete("render --geom"), "--geometry-limit\n");
    EXPECT_EQ(complete("bench sweep --lim"), "--limits\n");
    EXPECT_EQ(complete("render \"\""), "\n") << "an input: readline knows files";
    EXPECT_EQ(complete("render -o -"), "\n");
    EXPECT_EQ(complete("render --spp \"\""), "compopt +o default\n\n") << "a number is no file";
}

TEST_F(CliManual, FishCompletesWithAWordAboutEach) {
    if (!installed("fish")) GTEST_SKIP() << "fish is not installed";
    run("\"$raypager\" generate fish >completions.fish");
    const auto complete = [&](const std::string& words) {
        return run(fmt::format("HOME=$PWD fish --no-config -c 'source completions.fish; complete -C \"raypager {}\"'", words));
    };
    EXPECT_EQ(complete("ren"), "render\trender a scene or a block file\n");
    EXPECT_EQ(complete("bench tra"), "traverse\trays per second of the engine's own kernels on a baked scene\n");
    EXPECT_EQ(complete("compare --js").substr(0, 7), "--json\t");
    EXPECT_EQ(complete("devices --geometry"), "") << "an option of another verb";
}

TEST_F(CliManual, ShellsReadTheirCompletions) {
    for (const auto& [shell, command] : {std::pair{"bash", "bash -n"}, std::pair{"zsh", "zsh -n"}, std::pair{"fish", "fish --no-execute"}})
        if (installed(shell)) {
            EXPECT_EQ(run(fmt::format("\"$raypager\" generate {} >completions && {} completions", shell, command)), "");
        }
}

TEST_F(CliManual, NothingElseIsGenerated) {
    for (const char* what : {"", "html", "man bash"}) {
        const std::string text = run(fmt::format("! \"$raypager\" generate {}", what));
        EXPECT_EQ(text, "raypager: generate: takes one word: man, bash, zsh or fish\n");
    }
}

}  // namespace
}  // namespace raypager
