// The words of a pbrt scene file.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "raypager/status.hpp"

namespace raypager {

// A place in a file; cheap to copy.
struct PbrtLocation {
    std::shared_ptr<const std::string> file;
    uint32_t line = 1, column = 1;
    std::string with_line() const;    // file:line
    std::string with_column() const;  // file:line:column
};

enum class PbrtTokenKind { word, string, number, open, close, end };

struct PbrtToken {
    PbrtTokenKind kind = PbrtTokenKind::end;
    std::string text;   // of a word, or of a string without its quotes
    double number = 0;  // finite
    uint32_t line = 1, column = 1;
    std::string describe() const;  // for "expected ... instead of ..."
};

// Splits one file into tokens, with one token of look-ahead.
class PbrtTokens {
public:
    PbrtTokens(const std::filesystem::path& path, std::string text);
    // The coming token. Stays valid until take().
    Status peek(const PbrtToken*& token);
    void take() { ahead_ = false; }
    // Takes numbers as they mostly come, faster than token by token. False if anything is unusual about them: then none was taken, and what peek()
    // says of them counts.
    bool take_numbers(std::span<double> numbers);
    PbrtLocation location(const PbrtToken& token) const { return {file_, token.line, token.column}; }
    Status error(const PbrtToken& token, const std::string& what) const;  // file:line:column: what

private:
    Status scan();
    Status scan_string();
    Status scan_number();
    void skip_blanks();
    char advance();
    std::string_view advance_to(size_t end);
    size_t end_of_word() const;

    std::shared_ptr<const std::string> file_;
    std::string text_;
    size_t at_ = 0;
    uint32_t line_ = 1, column_ = 1;
    PbrtToken token_;
    bool ahead_ = false;
};

}  // namespace raypager
