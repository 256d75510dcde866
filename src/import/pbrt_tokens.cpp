#include "import/pbrt_tokens.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>

#include "import/text.hpp"

namespace raypager {
namespace {

constexpr std::string_view byte_order_mark = "\xef\xbb\xbf";

bool ends_line(char c) { return c == '\n' || c == '\r'; }
bool letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }
bool digit(char c) { return c >= '0' && c <= '9'; }
// Commas between numbers are blanks, as pbrt-v3 takes them.
bool separates(char c) { return is_blank(c) || c == ','; }
bool ends_word(char c) { return separates(c) || c == '"' || c == '[' || c == ']' || c == '#'; }

}  // namespace

std::string PbrtLocation::with_line() const { return fmt::format("{}:{}", *file, line); }
std::string PbrtLocation::with_column() const { return fmt::format("{}:{}:{}", *file, line, column); }

std::string PbrtToken::describe() const {
    switch (kind) {
        case PbrtTokenKind::word:
            return clipped(text);
        case PbrtTokenKind::string:
            return fmt::format("the string \"{}\"", clipped(text));
        case PbrtTokenKind::number:
            return fmt::format("the number {}", number);
        case PbrtTokenKind::open:
            return "[";
        case PbrtTokenKind::close:
            return "]";
        case PbrtTokenKind::end:
            return "the end of the file";
    }
    return {};
}

PbrtTokens::PbrtTokens(const std::filesystem::path& path, std::string text)
    : file_(std::make_shared<const std::string>(path.string())), text_(std::move(text)) {
    if (text_.starts_with(byte_order_mark)) at_ = byte_order_mark.size();
}

Status PbrtTokens::error(const PbrtToken& token, const std::string& what) const {
    return Status::failed(fmt::format("{}: {}", location(token).with_column(), what));
}

Status PbrtTokens::peek(const PbrtToken*& token) {
    token = &token_;
    if (ahead_) return {};
    ahead_ = true;
    return scan();
}

char PbrtTokens::advance() {
    const char c = text_[at_++];
    ++column_;
    // A line ends with LF, CR LF, or CR alone.
    if (c == '\n' || (c == '\r' && (at_ == text_.size() || text_[at_] != '\n'))) {
        ++line_;
        column_ = 1;
    }
    return c;
}

void PbrtTokens::skip_blanks() {
    while (at_ < text_.size()) {
        if (text_[at_] == '#')
            while (at_ < text_.size() && !ends_line(text_[at_])) advance();
        else if (separates(text_[at_]))
            advance();
        else
            return;
    }
}

Status PbrtTokens::scan() {
    skip_blanks();
    token_.line = line_;
    token_.column = column_;
    token_.text.clear();
    if (at_ == text_.size()) {
        token_.kind = PbrtTokenKind::end;
        return {};
    }
    const char c = text_[at_];
    if (c == '[' || c == ']') {
        token_.kind = c == '[' ? PbrtTokenKind::open : PbrtTokenKind::close;
        advance();
        return {};
    }
    if (c == '"') return scan_string();
    if (digit(c) || c == '-' || c == '+' || c == '.') return scan_number();
    if (!letter(c)) return error(token_, fmt::format("expected a directive, a string or a number instead of \"{}\"", clipped(text_.substr(at_, 1))));
    token_.kind = PbrtTokenKind::word;
    while (at_ < text_.size() && !ends_word(text_[at_])) token_.text += advance();
    return {};
}

Status PbrtTokens::scan_string() {
    token_.kind = PbrtTokenKind::string;
    advance();
    while (at_ < text_.size() && !ends_line(text_[at_])) {
        char c = advance();
        if (c == '"') return {};
        if (c == '\\') {
            if (at_ == text_.size() || ends_line(text_[at_])) break;
            c = advance();
            if (c == 'n') c = '\n';
            if (c == 't') c = '\t';
        }
        token_.text += c;
    }
    return error(token_, fmt::format("expected a closing quote before the end of the line, for the string \"{}\"", clipped(token_.text)));
}

Status PbrtTokens::scan_number() {
    token_.kind = PbrtTokenKind::number;
    const size_t begin = at_;
    while (at_ < text_.size() && !ends_word(text_[at_])) advance();
    const std::string_view word = std::string_view(text_).substr(begin, at_ - begin);
    const std::string_view digits = word[0] == '+' ? word.substr(1) : word;
    const auto [end, result] = std::from_chars(digits.data(), digits.data() + digits.size(), token_.number);
    if (result == std::errc::invalid_argument || end != digits.data() + digits.size() || digits.find_first_of("nN") != std::string_view::npos)
        return error(token_, fmt::format("expected a number instead of \"{}\"", clipped(word)));
    if (result == std::errc::result_out_of_range) {
        token_.number = std::strtod(std::string(digits).c_str(), nullptr);
        if (!std::isfinite(token_.number)) return error(token_, fmt::format("the number {} is out of range", clipped(word)));
    }
    return {};
}

}  // namespace raypager
