#include "device/kernel_tokens.hpp"

#include <algorithm>
#include <cctype>
#include <map>
#include <vector>

#include "base/hash.hpp"

namespace raypager {
namespace {

bool in_name(char c) { return std::isalnum(static_cast<unsigned char>(c)) || c == '_'; }
bool is_digit(char c) { return c >= '0' && c <= '9'; }

// Lines that end in a backslash go on with the next one, even within a token: that comes before everything else.
std::string join_lines(std::string_view text) {
    std::string joined;
    for (size_t at = 0; at < text.size(); at++) {
        if (text[at] == '\r') continue;
        size_t end = at + 1;
        while (end < text.size() && text[end] == '\r') end++;
        if (text[at] == '\\' && end < text.size() && text[end] == '\n')
            at = end;
        else
            joined += text[at];
    }
    return joined;
}

// Cuts a text whose lines are joined into tokens: names, numbers, strings, signs.
class Scanner {
public:
    explicit Scanner(std::string_view text) : rest_(text) {}

    struct Token {
        std::string_view text;       // empty: there is none left
        bool first_of_line = false;  // nothing but comments and white space is before it
        bool attached = false;       // nothing at all is between it and the one before
    };

    Token next() {
        const bool begins = at_start_;
        Token token;
        token.first_of_line = skip_space() || begins;
        token.attached = !begins && !spaced_;
        at_start_ = false;
        token.text = take(length());
        return token;
    }

private:
    // White space and comments; returns whether there was the end of a line among it.
    bool skip_space() {
        bool line_ended = false;
        const size_t before = rest_.size();
        for (;;) {
            if (rest_.starts_with("//")) {
                take(std::min(rest_.find('\n'), rest_.size()));
            } else if (rest_.starts_with("/*")) {
                const size_t end = rest_.find("*/", 2);
                take(end == std::string_view::npos ? rest_.size() : end + 2);
            } else if (!rest_.empty() && std::isspace(static_cast<unsigned char>(rest_[0]))) {
                line_ended = line_ended || rest_[0] == '\n';
                take(1);
            } else {
                spaced_ = rest_.size() != before;
                return line_ended;
            }
        }
    }

    // Of the token that begins here.
    size_t length() const {
        if (rest_.empty()) return 0;
        const char first = rest_[0];
        if (first == '"' || first == '\'') return quoted_length(first);
        if (is_digit(first) || (first == '.' && rest_.size() > 1 && is_digit(rest_[1]))) return number_length();
        if (in_name(first)) return static_cast<size_t>(std::ranges::find_if_not(rest_, in_name) - rest_.begin());
        return sign_length();
    }

    // To its end, or to that of the line.
    size_t quoted_length(char quote) const {
        for (size_t i = 1; i < rest_.size() && rest_[i] != '\n'; i++) {
            if (rest_[i] == quote) return i + 1;
            if (rest_[i] == '\\') i++;
        }
        return std::min(rest_.find('\n'), rest_.size());
    }

    // As a preprocessor sees numbers: "1e-5f", "0x1p+3", "3.f".
    size_t number_length() const {
        size_t i = 1;
        for (; i < rest_.size(); i++) {
            const char before = static_cast<char>(std::tolower(static_cast<unsigned char>(rest_[i - 1])));
            const bool sign_of_exponent = (rest_[i] == '+' || rest_[i] == '-') && (before == 'e' || before == 'p');
            if (!in_name(rest_[i]) && rest_[i] != '.' && !sign_of_exponent) break;
        }
        return i;
    }

    size_t sign_length() const {
        // The longest that fits is taken: "a+++b" is "a ++ + b".
        for (const std::string_view sign : {"<<=", ">>=", "...", "<<", ">>", "<=", ">=", "==", "!=", "&&", "||", "++",
                                            "--",  "+=",  "-=",  "*=", "/=", "%=", "&=", "|=", "^=", "->", "##"})
            if (rest_.starts_with(sign)) return sign.size();
        return 1;
    }

    std::string_view take(size_t count) {
        const std::string_view taken = rest_.substr(0, count);
        rest_.remove_prefix(taken.size());
        return taken;
    }

    std::string_view rest_;
    bool at_start_ = true, spaced_ = false;
};

// Names of what a text includes: its directives stand in lines of their own.
std::vector<std::string> included(const std::string& tokens) {
    constexpr std::string_view include = "\n# include \"";
    std::vector<std::string> names;
    for (size_t at = tokens.find(include); at != std::string::npos; at = tokens.find(include, at)) {
        at += include.size();
        names.push_back(tokens.substr(at, tokens.find('"', at) - at));
    }
    return names;
}

}  // namespace

std::string kernel_tokens(std::string_view text) {
    const std::string joined = join_lines(text);
    Scanner scanner(joined);
    std::string result;
    bool directive = false;
    int of_directive = 0;   // tokens so far
    std::string_view name;  // of the directive
    for (Scanner::Token token = scanner.next(); !token.text.empty(); token = scanner.next()) {
        if (token.first_of_line && (directive || token.text == "#")) {
            result += '\n';
            directive = token.text == "#";
            of_directive = 0;
        }
        if (directive && of_directive == 1) name = token.text;
        // A macro has parameters if the bracket is next to its name.
        const bool parameters = directive && of_directive == 3 && name == "define" && token.text == "(" && token.attached;
        if (!result.empty() && result.back() != '\n' && !parameters) result += ' ';
        result += token.text;
        of_directive++;
    }
    return result;
}

uint64_t kernels_identity(std::span<const KernelSource> sources, std::span<const std::string_view> stages) {
    std::map<std::string, std::string> tokens;  // by name
    std::vector<std::string> left;
    for (const std::string_view stage : stages) left.push_back(std::string(stage) + ".cl");
    while (!left.empty()) {
        const std::string name = left.back();
        left.pop_back();
        const auto source = std::ranges::find(sources, name, &KernelSource::name);
        if (source == sources.end() || tokens.contains(name)) continue;
        for (std::string& more : included(tokens[name] = "\n" + kernel_tokens(source->text))) left.push_back(std::move(more));
    }
    uint64_t hash = 0;
    for (const auto& [name, text] : tokens) hash = hash64(text, hash64(name, hash));
    return hash;
}

}  // namespace raypager
