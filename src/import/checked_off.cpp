#include <fmt/format.h>

#include "import/checked_input.hpp"
#include "import/text.hpp"

namespace raypager {
namespace {

// Keeps the positions and the polygons; comments, colours, normals and texture coordinates go.
class OffText final : public CheckedText {
public:
    using CheckedText::CheckedText;

protected:
    Status rewrite(std::string_view line, std::string& out) override {
        split_words(line.substr(0, line.find('#')), words_);
        if (words_.empty()) return {};
        if (!has_header_) return header(out);
        if (!has_counts_) return counts(0, out);
        if (vertices_ < vertex_count_) return vertex(out);
        if (faces_ < face_count_) return face(out);
        return bad("text after the last face; counts and data do not match");
    }

    Status finish() override {
        if (!has_counts_) return Status::failed(file_.path().string() + ": ends before its counts; it is truncated or no OFF file");
        if (vertices_ == vertex_count_ && faces_ == face_count_) return {};
        return Status::failed(fmt::format("{}: ends after {} of {} vertices and {} of {} faces; it is truncated", file_.path().string(), vertices_,
                                          vertex_count_, faces_, face_count_));
    }

private:
    // [ST][C][N][4][n]OFF, possibly with the counts on the same line.
    Status header(std::string& out) {
        std::string_view prefix = words_[0];
        if (prefix.size() < 3 || prefix.substr(prefix.size() - 3) != "OFF") return bad("does not start with \"OFF\": not an OFF file");
        prefix.remove_suffix(3);
        if (prefix.find_first_not_of("STCN") != std::string_view::npos)
            return bad(fmt::format("\"{}\" is a kind of OFF that cannot be read here; only three-dimensional ones can", clipped(words_[0])));
        if (words_.size() > 1 && words_[1] == "BINARY") return bad("binary OFF cannot be read here; convert it to text, or to PLY");
        has_header_ = true;
        return words_.size() > 1 ? counts(1, out) : Status();
    }

    Status counts(size_t first, std::string& out) {
        uint64_t values[2] = {0, 0};
        for (size_t i = 0; i < 2; ++i)
            if (first + i >= words_.size() || !parse_count(words_[first + i], values[i]))
                return bad("expected the numbers of vertices, faces and edges");
        vertex_count_ = values[0];
        face_count_ = values[1];
        if (vertex_count_ == 0 || face_count_ == 0) return bad("has no vertices or no faces");
        // A vertex takes six bytes at least ("0 0 0" and a newline), a face two.
        if (vertex_count_ > file_.size() / 6 || face_count_ > file_.size() / 2)
            return bad(fmt::format("{} vertices and {} faces cannot be in {} bytes; the file is truncated or damaged", vertex_count_, face_count_,
                                   file_.size()));
        if (vertex_count_ > 0x7ffffffe) return bad("more than 2147483646 vertices");
        has_counts_ = true;
        fmt::format_to(std::back_inserter(out), "OFF\n{} {} 0\n", vertex_count_, face_count_);
        return {};
    }

    Status vertex(std::string& out) {
        RAYPAGER_TRY(append_position(words_, {0, 1, 2}, out));
        out += '\n';
        ++vertices_;
        return {};
    }

    Status face(std::string& out) {
        uint64_t corners = 0;
        if (!parse_count(words_[0], corners)) return bad(fmt::format("\"{}\" is no number of corners", clipped(words_[0])));
        if (corners > words_.size() - 1) return bad(fmt::format("a face of {} corners lists only {}", corners, words_.size() - 1));
        fmt::format_to(std::back_inserter(out), "{}", corners);
        RAYPAGER_TRY(append_indices(std::span(words_).subspan(1, corners), out));
        out += '\n';
        ++faces_;
        return {};
    }

    bool has_header_ = false, has_counts_ = false;
    uint64_t vertex_count_ = 0, face_count_ = 0, vertices_ = 0;
};

}  // namespace

std::unique_ptr<CheckedInput> check_off_text(const InputFile& file) { return std::make_unique<OffText>(file); }

}  // namespace raypager
