// The manual page, in the macros of man(7).
#include <fmt/format.h>

#include <sstream>

#include "cli/describe_verbs.hpp"

namespace raypager {
namespace {

// Text as it is, whatever it has in it that means something to troff.
std::string roff_text(const std::string& text) {
    std::string result;
    for (const char c : text) {
        switch (c) {
            case '\\':
                result += "\\e";
                break;
            case '-':
                result += "\\-";
                break;
            case '\'':
                result += "\\(aq";
                break;
            case '"':
                result += "\\(dq";
                break;
            case '`':
                result += "\\(ga";
                break;
            case '^':
                result += "\\(ha";
                break;
            case '~':
                result += "\\(ti";
                break;
            default:
                result += c;
        }
    }
    return result.starts_with('.') ? "\\&" + result : result;
}

std::string bold(const std::string& text) { return "\\fB" + roff_text(text) + "\\fR"; }
std::string italic(const std::string& text) { return "\\fI" + roff_text(text) + "\\fR"; }

// Lines that begin with a blank are rows of a list, and stay as they are, as in the help.
std::string paragraphs(const std::string& text) {
    std::istringstream lines(text);
    std::string result;
    bool rows = false;
    for (std::string line; std::getline(lines, line);) {
        if (line.starts_with(' ') != rows) result += rows ? ".fi\n.PP\n" : ".PP\n.nf\n";
        rows = line.starts_with(' ');
        if (!line.empty()) result += roff_text(line) + '\n';
    }
    return result + (rows ? ".fi\n" : "");
}

std::string option_entry(const OptionDescription& option) {
    std::string names = bold("--" + option.name);
    if (!option.letter.empty()) names = bold("-" + option.letter) + ", " + names;
    if (!option.value.empty()) names += ' ' + italic(option.value);
    return ".TP\n" + names + '\n' + roff_text(option.help) + '\n';
}

std::string verb_section(const DescribedVerb& verb) {
    const VerbDescription& description = verb.description;
    std::string text = fmt::format(".SS {}\n{} {}\n.PP\n{}", roff_text(verb.name), bold("raypager " + verb.name), roff_text(description.usage),
                                   paragraphs(description.about));
    for (const OptionDescription& option : description.options) text += option_entry(option);
    return text;
}

std::string entry(const std::string& name, const std::string& text) { return ".TP\n" + bold(name) + '\n' + roff_text(text) + '\n'; }

std::string environment_section() {
    return ".SH ENVIRONMENT\n" + entry("RAYPAGER_DEVICE", "the device to render on where --device is not given: number or part of its name") +
           entry("RAYPAGER_OIDN", "the library with which --denoise works: path of Open Image Denoise's libOpenImageDenoise.so") +
           entry("TMPDIR", "folder for scratch files of packed inputs") +
           entry("XDG_CACHE_HOME",
                 "where kernels are kept that were compiled before, and block files of inputs that lie where nothing can be written");
}

std::string exit_section() {
    return ".SH EXIT STATUS\n" + entry("0", "done") + entry("1", "the work failed; one line on standard error says what, where and what to do") +
           entry("2", "bad usage") + entry("3", "stopped by SIGINT or SIGTERM; what there is was written");
}

}  // namespace

std::string man_page(const std::vector<DescribedVerb>& verbs) {
    std::string text =
        ".TH RAYPAGER 1 \"\" \"raypager " RAYPAGER_VERSION
        "\" \"User Commands\"\n.ad l\n.nh\n.SH NAME\nraypager \\- path\\-trace scenes many times larger than the device's memory\n.SH SYNOPSIS\n"
        "\\fBraypager\\fR \\fIVERB\\fR \\fIINPUT\\fR... [\\fIoptions\\fR]\n.br\n\\fBraypager help\\fR [\\fIVERB\\fR]\n.br\n"
        "\\fBraypager \\-\\-version\\fR\n.SH DESCRIPTION\n"
        "raypager cuts geometry into blocks and images into pages on disk, and renders scenes with as much of both on an OpenCL device as a limit "
        "allows. The picture is the same at every limit.\n.PP\n"
        "Sizes take a unit: 512K, 1.5G, 8GB, 8GiB (all binary). Numbers of things do, too: 2.5M (decimal).\n.PP\nVerbs:\n";
    for (const DescribedVerb& verb : verbs) text += entry(verb.name, verb.summary);
    text += ".SH VERBS AND THEIR OPTIONS\n";
    for (const DescribedVerb& verb : verbs) text += verb_section(verb);
    return text + environment_section() + exit_section();
}

}  // namespace raypager
