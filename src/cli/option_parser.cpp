#include "cli/option_parser.hpp"

#include <fmt/format.h>

#include <boost/program_options.hpp>
#include <cstdio>
#include <optional>
#include <set>
#include <sstream>

#include "cli/values.hpp"

namespace raypager {
namespace {

namespace options = boost::program_options;

constexpr unsigned help_columns = 80;

constexpr const char *help_name = "help,h", *help_of_help = "show this text";

constexpr const char* inputs_key = "(inputs)";  // no option can be called so

options::options_description describe(const auto& declared) {
    options::options_description visible("Options", help_columns, 50);
    for (const auto& entry : declared) {
        if (entry.value.empty())
            visible.add_options()(entry.name.c_str(), entry.help.c_str());
        else
            visible.add_options()(entry.name.c_str(), options::value<std::string>()->value_name(entry.value), entry.help.c_str());
    }
    visible.add_options()(help_name, help_of_help);
    return visible;
}

// Words in lines of help_columns characters at most, whatever line ends stand between them.
std::string wrapped_paragraph(const std::string& text) {
    std::istringstream words(text);
    std::string result, line;
    for (std::string word; words >> word;) {
        if (!line.empty() && line.size() + 1 + word.size() > help_columns) {
            result += line + '\n';
            line.clear();
        }
        line += (line.empty() ? "" : " ") + word;
    }
    return result + line;
}

// Lines that begin with a blank are rows of a list, and stay as they are.
std::string wrapped(const std::string& text) {
    std::istringstream lines(text);
    std::string result, paragraph;
    const auto end_paragraph = [&] {
        if (!paragraph.empty()) result += wrapped_paragraph(paragraph) + '\n';
        paragraph.clear();
    };
    for (std::string line; std::getline(lines, line);) {
        if (line.starts_with(' ')) {
            end_paragraph();
            result += line + '\n';
        } else {
            paragraph += line + ' ';
        }
    }
    end_paragraph();
    if (!result.empty()) result.pop_back();
    return result;
}

std::string long_name(const std::string& name) { return name.substr(0, name.find(',')); }

// Where the next parser is to describe itself instead of reading arguments; null: nowhere.
thread_local std::optional<VerbDescription>* described = nullptr;

}  // namespace

Result<VerbDescription> describe_verb(Status (*run)(const Arguments& arguments)) {
    std::optional<VerbDescription> description;
    described = &description;
    const Status status = run({"--help"});
    described = nullptr;
    if (!status) return status;
    if (!description) return Status::failed("a verb without options; this is a bug");
    return std::move(*description);
}

OptionParser::OptionParser(std::string verb, std::string usage, std::string about)
    : verb_(std::move(verb)), usage_(std::move(usage)), about_(std::move(about)) {}

void OptionParser::option(std::string name, std::string value, std::string help, Setter set) {
    declared_.push_back({std::move(name), std::move(value), std::move(help), std::move(set)});
}

void OptionParser::flag(std::string name, std::string help, bool& target) {
    declared_.push_back({std::move(name), "", std::move(help), [&target](const std::string&) {
                             target = true;
                             return Status();
                         }});
}

void OptionParser::inputs(std::string what, size_t lowest, size_t highest, std::vector<std::string>& target) {
    inputs_name_ = std::move(what);
    inputs_lowest_ = lowest;
    inputs_highest_ = highest;
    inputs_ = &target;
}

Status OptionParser::wrong(const std::string& message) const { return Status::usage(fmt::format("{}: {}", verb_, message)); }

std::string OptionParser::help_text() const {
    std::ostringstream text;
    text << "Usage: raypager " << verb_ << (usage_.empty() ? "" : " ") << usage_ << "\n\n" << wrapped(about_) << "\n\n" << describe(declared_);
    return text.str();
}

VerbDescription OptionParser::description() const {
    VerbDescription result{usage_, about_, {}, inputs_ != nullptr};
    const auto add = [&](const std::string& name, const std::string& value, const std::string& help) {
        const size_t comma = name.find(',');
        result.options.push_back({long_name(name), comma == std::string::npos ? "" : name.substr(comma + 1), value, help});
    };
    for (const Declared& entry : declared_) add(entry.name, entry.value, entry.help);
    add(help_name, "", help_of_help);
    return result;
}

Status OptionParser::apply(const std::string& key, const std::string& text) const {
    for (const Declared& entry : declared_) {
        if (long_name(entry.name) != key) continue;
        const Status status = entry.set(text);
        return status ? status : wrong(fmt::format("--{}: {}", key, status.message()));
    }
    return wrong(fmt::format("--{}: is not an option", key));
}

Result<OptionParser::Outcome> OptionParser::parse(const Arguments& arguments) const {
    if (described) {
        *described = description();
        return Outcome::help_shown;
    }
    options::options_description all = describe(declared_);
    all.add_options()(inputs_key, options::value<std::vector<std::string>>());
    options::positional_options_description positional;
    positional.add(inputs_key, -1);
    const std::string see_help = fmt::format("; see 'raypager {} --help'", verb_);
    std::vector<options::option> given;
    try {
        using namespace options::command_line_style;  // an abbreviation that works today would break when an option is added
        given = options::command_line_parser(arguments).options(all).positional(positional).style(unix_style & ~allow_guessing).run().options;
    } catch (const options::unknown_option& error) {
        return wrong(fmt::format("unknown option {}{}", error.get_option_name(), see_help));
    } catch (const options::error& error) {
        return wrong(error.what() + see_help);
    }
    for (const options::option& option : given)
        if (option.string_key == "help") {
            std::fputs(help_text().c_str(), stdout);
            return Outcome::help_shown;
        }
    std::set<std::string> seen;
    for (const options::option& option : given) {
        if (option.string_key == inputs_key) {
            if (inputs_)
                inputs_->insert(inputs_->end(), option.value.begin(), option.value.end());
            else
                return wrong(fmt::format("'{}' is not expected here{}", option.value.front(), see_help));
            continue;
        }
        if (!seen.insert(option.string_key).second) return wrong(fmt::format("--{}: is given more than once", option.string_key));
        RAYPAGER_TRY(apply(option.string_key, option.value.empty() ? std::string() : option.value.front()));
    }
    if (inputs_ && inputs_->size() < inputs_lowest_) return wrong(fmt::format("{} is missing{}", inputs_name_, see_help));
    if (inputs_ && inputs_->size() > inputs_highest_) return wrong(fmt::format("'{}' is one too many{}", (*inputs_)[inputs_highest_], see_help));
    return Outcome::run;
}

OptionParser::Setter into_count(uint32_t& target, uint64_t lowest, uint64_t highest) {
    return into(target, [lowest, highest](const std::string& text) { return parse_count(text, lowest, highest); });
}

OptionParser::Setter into_path(std::filesystem::path& target) {
    return into(target, [](const std::string& text) -> Result<std::filesystem::path> {
        if (text.empty()) return Status::usage("is empty; give a path");
        return std::filesystem::path(text);
    });
}

}  // namespace raypager
