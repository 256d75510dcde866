#include "import/checked_input.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "import/text.hpp"

namespace raypager {
namespace {

constexpr size_t content_goal = size_t{64} << 10;

}  // namespace

CheckedInput::int_type CheckedInput::underflow() {
    if (gptr() < egptr()) return traits_type::to_int_type(*gptr());
    content_.clear();
    if (error_.ok()) error_ = produce(content_);
    if (!error_.ok()) throw InputError{};
    if (content_.empty()) return traits_type::eof();
    setg(content_.data(), content_.data(), content_.data() + content_.size());
    return traits_type::to_int_type(*gptr());
}

CheckedInput::pos_type CheckedInput::seekoff(off_type offset, std::ios_base::seekdir direction, std::ios_base::openmode) {
    if (offset != 0 || direction != std::ios_base::beg) return pos_type(off_type(-1));
    content_.clear();
    setg(nullptr, nullptr, nullptr);
    rewind();
    return pos_type(off_type(0));
}

CheckedInput::pos_type CheckedInput::seekpos(pos_type position, std::ios_base::openmode mode) {
    return seekoff(off_type(position), std::ios_base::beg, mode);
}

void CheckedText::rewind() {
    CheckedInput::rewind();
    reader_.emplace(file_);
    finished_ = false;
}

Status CheckedText::produce(std::string& out) {
    while (!finished_ && out.size() < content_goal) {
        std::string_view line;
        RAYPAGER_TRY(reader_->next(line, finished_));
        if (finished_) return finish();
        RAYPAGER_TRY(rewrite(line, out));
    }
    return {};
}

Status CheckedText::append_position(const std::vector<std::string_view>& words, std::array<size_t, 3> at, std::string& out) const {
    for (const size_t i : at) {
        if (i >= words.size()) return bad("too few numbers; three coordinates are needed");
        const NumberKind kind = classify_number(words[i]);
        if (kind == NumberKind::none) return bad(fmt::format("\"{}\" is no number", clipped(words[i])));
        out += ' ';
        if (kind == NumberKind::finite)
            out += words[i];
        else
            out += "3.402823466e+38";
    }
    return {};
}

Status CheckedText::append_normal(const std::vector<std::string_view>& words, std::array<size_t, 3> at, std::string& out) const {
    const size_t before = out.size();
    RAYPAGER_TRY(append_position(words, at, out));
    for (const size_t i : at)
        if (classify_number(words[i]) != NumberKind::finite) {
            out.resize(before);
            out += " 0 0 0";
            break;
        }
    return {};
}

Status CheckedText::append_indices(std::span<const std::string_view> words, std::string& out) const {
    constexpr int64_t no_vertex = 0x7fffffff;
    for (const std::string_view word : words) {
        int64_t index = 0;
        const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), index);
        if (error != std::errc() || end != word.data() + word.size()) return bad(fmt::format("\"{}\" is no vertex number", clipped(word)));
        fmt::format_to(std::back_inserter(out), " {}", index < 0 || index > no_vertex ? no_vertex : index);
    }
    return {};
}

bool CheckedText::parse_count(std::string_view word, uint64_t& value) {
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    return error == std::errc() && end == word.data() + word.size();
}

}  // namespace raypager
