#include "import/pbrt_tokens.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <tuple>

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
        const char c = text_[at_];
        if (c == '#')
            while (at_ < text_.size() && !ends_line(text_[at_])) advance();
        else if (c == ' ')
            at_++, column_++;
        else if (separates(c))
            advance();
        else
            return;
    }
}

// None of them ends a line.
std::string_view PbrtTokens::advance_to(size_t end) {
    const auto passed = std::string_view(text_).substr(at_, end - at_);
    column_ += static_cast<uint32_t>(passed.size());
    at_ = end;
    return passed;
}

bool PbrtTokens::take_numbers(std::span<double> numbers) {
    if (ahead_) return false;
    const auto before = std::tuple(at_, line_, column_);
    const char* const end = text_.data() + text_.size();
    for (double& number : numbers) {
        skip_blanks();
        const char* const begin = text_.data() + at_;
        const char* const first = begin + (begin < end && *begin == '-');
        std::from_chars_result read = {begin, std::errc::invalid_argument};
        if (first < end && (digit(*first) || *first == '.')) read = std::from_chars(begin, end, number);
        if (read.ec != std::errc() || (read.ptr < end && !ends_word(*read.ptr))) {
            std::tie(at_, line_, column_) = before;
            return false;
        }
        advance_to(static_cast<size_t>(read.ptr - text_.data()));
    }
    return true;
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
    token_.text = advance_to(end_of_word());
    return {};
}

size_t PbrtTokens::end_of_word() const {
    size_t end = at_;
    while (end < text_.size() && !ends_word(text_[end])) end++;
    return end;
}

Status PbrtTokens::scan_string() {
    token_.kind = PbrtTokenKind::string;
    advance();
    while (at_ < text_.size() && !ends_line(text_[at_])) {
        size_t plain = at_;
        while (plain < text_.size() && !ends_line(text_[plain]) && text_[plain] != '"' && text_[plain] != '\\') plain++;
        token_.text += advance_to(plain);
        if (at_ == text_.size() || ends_line(text_[at_])) break;
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
    const std::string_view word = advance_to(end_of_word());
    const std::string_view digits = word[0] == '+' ? word.substr(1) : word;
    const auto [end, result] = std::from_chars(digits.data(), digits.data() + digits.size(), token_.number);
    // Neither infinities nor what is no number at all.
    const std::string_view unsigned_digits = digits.substr(digits.starts_with('-'));
    const bool named = !unsigned_digits.empty() && letter(unsigned_digits[0]);
    if (result == std::errc::invalid_argument || end != digits.data() + digits.size() || named)
        return error(token_, fmt::format("expected a number instead of \"{}\"", clipped(word)));
    if (result == std::errc::result_out_of_range) {
        token_.number = std::strtod(std::string(digits).c_str(), nullptr);
        if (!std::isfinite(token_.number)) return error(token_, fmt::format("the number {} is out of range", clipped(word)));
    }
    return {};
}

}  // namespace raypager
