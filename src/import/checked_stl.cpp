#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "import/checked_input.hpp"
#include "import/text.hpp"

namespace raypager {
namespace {

constexpr uint64_t stl_header_bytes = 84, triangle_bytes = 50;

bool same(std::string_view word, std::string_view keyword) {
    return word.size() == keyword.size() && std::equal(word.begin(), word.end(), keyword.begin(), [](char a, char b) { return (a | 0x20) == b; });
}

// Text: solid { facet normal n n n / outer loop / three of vertex x y z / endloop / endfacet } endsolid, one to a line.
class StlText final : public CheckedText {
public:
    using CheckedText::CheckedText;

protected:
    Status rewrite(std::string_view line, std::string& out) override {
        split_words(line, words_);
        if (words_.empty()) return {};
        const auto is = [&](std::string_view keyword) { return same(words_[0], keyword); };
        switch (state_) {
            case State::outside:
                return is("solid") ? go(State::solid) : expected("solid");
            case State::solid:
                if (is("endsolid")) return go(State::outside);
                return is("facet") ? go(State::facet) : expected("facet or endsolid");
            case State::facet:
                if (!is("outer")) return expected("outer loop");
                out += "outer loop\n";
                corners_ = 0;
                return go(State::loop);
            case State::loop:
                if (!is("vertex")) return expected("vertex");
                out += "vertex";
                RAYPAGER_TRY(append_position(words_, {1, 2, 3}, out));
                out += '\n';
                if (++corners_ < 3) return {};
                ++faces_;
                return go(State::loop_end);
            case State::loop_end:
                return is("endloop") ? go(State::facet_end) : expected("endloop");
            case State::facet_end:
                return is("endfacet") ? go(State::solid) : expected("endfacet");
        }
        return {};
    }

    Status finish() override {
        if (state_ != State::outside) return bad("the file ends before endsolid; it is truncated");
        return faces_ > 0 ? Status() : Status::failed(file_.path().string() + ": has no triangles");
    }

private:
    enum class State { outside, solid, facet, loop, loop_end, facet_end };
    Status go(State next) {
        state_ = next;
        return {};
    }
    Status expected(const char* what) const { return bad(fmt::format("expected {} instead of \"{}\"", what, clipped(words_[0]))); }

    State state_ = State::outside;
    int corners_ = 0;
};

// Binary: 80 bytes, the number of triangles, then 50 bytes each: normal, three corners, two bytes of attributes.
class StlBinary final : public CheckedInput {
public:
    using CheckedInput::CheckedInput;

protected:
    Status produce(std::string& out) override {
        const uint64_t left = file_.size() - offset_;
        if (left == 0) return {};
        const uint64_t count = offset_ == 0 ? stl_header_bytes : std::min<uint64_t>(left, 4096 * triangle_bytes);
        out.resize(count);
        RAYPAGER_TRY(file_.read(offset_, std::as_writable_bytes(std::span(out))));
        if (offset_ > 0)
            for (uint64_t at = 0; at < count; at += triangle_bytes, ++faces_) replace_not_finite(out.data() + at + 12);
        offset_ += count;
        return {};
    }

private:
    // OpenMesh merges equal corners with a comparison that NaN breaks.
    static void replace_not_finite(char* corners) {
        for (size_t i = 0; i < 9; ++i) {
            float value = 0;
            std::memcpy(&value, corners + 4 * i, 4);
            if (!std::isfinite(value)) std::memcpy(corners + 4 * i, &not_finite_coordinate, 4);
        }
    }

    uint64_t offset_ = 0;
};

}  // namespace

Result<StlKind> find_stl_kind(const InputFile& file) {
    const std::string name = file.path().string();
    std::string start(std::min<uint64_t>(file.size(), stl_header_bytes), '\0');
    RAYPAGER_TRY(file.read(0, std::as_writable_bytes(std::span(start))));
    uint32_t triangles = 0;
    if (start.size() == stl_header_bytes) std::memcpy(&triangles, start.data() + 80, 4);
    const uint64_t expected = stl_header_bytes + triangle_bytes * triangles;
    if (start.size() == stl_header_bytes && file.size() == expected) {
        if (triangles == 0) return Status::failed(name + ": has no triangles");
        return StlKind::binary;
    }
    const auto words = split_words(start);
    if (!words.empty() && same(words[0].substr(0, 5), "solid")) return StlKind::text;
    if (start.size() < stl_header_bytes) return Status::failed(fmt::format("{}: {} bytes are too few for an STL file", name, file.size()));
    return Status::failed(fmt::format("{}: neither text STL (\"solid\") nor binary STL: its {} triangles would take {} bytes, but the file has {}",
                                      name, triangles, expected, file.size()));
}

std::unique_ptr<CheckedInput> check_stl_text(const InputFile& file) { return std::make_unique<StlText>(file); }
std::unique_ptr<CheckedInput> check_stl_binary(const InputFile& file) { return std::make_unique<StlBinary>(file); }

}  // namespace raypager
