// The options of one verb: declared with what becomes of their values, then read from the command line. Keeps Boost in one file.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "raypager/status.hpp"

namespace raypager {

using Arguments = std::vector<std::string>;  // behind the verb

// What --help says of a verb, as data.
struct OptionDescription {
    std::string name, letter, value, help;  // "output", "o" or empty, "FILE" or empty for a flag
};
struct VerbDescription {
    std::string usage, about;
    std::vector<OptionDescription> options;  // --help among them
    bool takes_inputs = false;
};
// Of the verb that this runs: no option is read, and nothing is done but declaring them.
Result<VerbDescription> describe_verb(Status (*run)(const Arguments& arguments));

class OptionParser {
public:
    using Setter = std::function<Status(const std::string& text)>;

    // usage: what stands behind the verb, such as "INPUT... -o FILE.rpb [options]"; about: a few lines for --help.
    OptionParser(std::string verb, std::string usage, std::string about);
    // name: "spp", or "output,o" with a short form. value: the value's name in --help. help: with default and unit.
    void option(std::string name, std::string value, std::string help, Setter set);
    void flag(std::string name, std::string help, bool& target);
    // Arguments that belong to no option. At least lowest and at most highest of them; what they are called in messages.
    void inputs(std::string what, size_t lowest, size_t highest, std::vector<std::string>& target);

    enum class Outcome { run, help_shown };
    // Calls the setters in the order of the command line. Errors name the verb and the option and have the kind "usage".
    Result<Outcome> parse(const Arguments& arguments) const;
    // A usage error of this verb, for rules between options.
    Status wrong(const std::string& message) const;

private:
    struct Declared {
        std::string name, value, help;  // value is empty for a flag
        Setter set;
    };
    std::string help_text() const;
    VerbDescription description() const;
    Status apply(const std::string& key, const std::string& text) const;

    std::string verb_, usage_, about_;
    std::vector<Declared> declared_;
    std::string inputs_name_;
    size_t inputs_lowest_ = 0, inputs_highest_ = 0;
    std::vector<std::string>* inputs_ = nullptr;
};

// Setters: parse the text and keep the value.
template <class Target, class Parse>
OptionParser::Setter into(Target& target, Parse parse) {
    return [&target, parse = std::move(parse)](const std::string& text) -> Status {
        auto value = parse(text);
        if (!value) return value.status();
        target = static_cast<Target>(std::move(*value));
        return {};
    };
}
OptionParser::Setter into_count(uint32_t& target, uint64_t lowest, uint64_t highest);
OptionParser::Setter into_path(std::filesystem::path& target);  // must not be empty

}  // namespace raypager
