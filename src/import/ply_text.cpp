#include <fmt/format.h>

#include <charconv>

#include "import/line_reader.hpp"
#include "import/ply_mesh.hpp"
#include "import/text.hpp"

namespace raypager {
namespace {

// How items are told apart: each is one line; or they are words one after the other, wherever the lines end.
enum class PlyTextLayout { lines, words };

class PlyText {
public:
    PlyText(const InputFile& file, const PlyHeader& header, const PlyLayout& layout, PlyTextLayout text, const MeshView& view, MeshIssues& issues)
        : file_(file), header_(header), layout_(layout), text_(text), lines_(file, header.bytes, header.lines + 1), out_(layout, view, issues) {}

    Status read() {
        out_.mesh().positions.reserve(layout_.vertices->count);
        if (layout_.faces) out_.mesh().triangles.reserve(layout_.faces->count);
        for (const PlyElement& element : header_.elements) {
            element_ = &element;
            for (items_ = 0; items_ < element.count; ++items_) {
                if (text_ == PlyTextLayout::lines) RAYPAGER_TRY(next_line());
                RAYPAGER_TRY(out_.read_item(element, *this));
                if (text_ == PlyTextLayout::lines && at_ < words_.size())
                    return lines_.bad(fmt::format("too many values for an item of \"{}\"", clipped(element.name)));
            }
        }
        RAYPAGER_TRY(expect_end());
        out_.finish();
        return {};
    }

    TriangleMesh& mesh() { return out_.mesh(); }

    // What PlyMesh asks for.
    Status number(PlyType, double& value) {
        RAYPAGER_TRY(next_word());
        const auto parsed = parse_number(word());
        if (!parsed) return lines_.bad(fmt::format("\"{}\" is no number", clipped(word())));
        value = *parsed;
        return {};
    }
    Status index(PlyType, int64_t& value) {
        RAYPAGER_TRY(next_word());
        if (!parse(value)) return lines_.bad(fmt::format("\"{}\" is no vertex number", clipped(word())));
        return {};
    }
    Status length(PlyType, PlyType, uint64_t& value) {
        RAYPAGER_TRY(next_word());
        if (!parse(value)) return lines_.bad(fmt::format("\"{}\" is no length of a list", clipped(word())));
        const uint64_t there = text_ == PlyTextLayout::lines ? words_.size() - at_ : file_.size() / 2;
        return value <= there ? Status() : lines_.bad(fmt::format("a list of {} values has only {}", value, there));
    }
    Status skip(PlyType, uint64_t count) {
        for (uint64_t i = 0; i < count; ++i) RAYPAGER_TRY(next_word());
        return {};
    }

private:
    std::string_view word() const { return words_[at_ - 1]; }  // that next_word() found

    Status next_word() {
        if (text_ == PlyTextLayout::words && at_ == words_.size()) RAYPAGER_TRY(next_line());
        if (at_ == words_.size()) return lines_.bad(fmt::format("too few values for an item of \"{}\"", clipped(element_->name)));
        ++at_;
        return {};
    }

    // The next line that is not empty.
    Status next_line() {
        do {
            std::string_view line;
            bool end = false;
            RAYPAGER_TRY(lines_.next(line, end));
            if (end)
                return Status::failed(fmt::format("{}: ends after {} of {} items of \"{}\"; it is truncated", file_.path().string(), items_,
                                                  element_->count, clipped(element_->name)));
            split_words(line, words_);
        } while (words_.empty());
        at_ = 0;
        return {};
    }

    Status expect_end() {
        if (at_ < words_.size()) return lines_.bad("text after the last element; header and data do not match");
        while (true) {
            std::string_view line;
            bool end = false;
            RAYPAGER_TRY(lines_.next(line, end));
            if (end) return {};
            split_words(line, words_);
            if (!words_.empty()) return lines_.bad("text after the last element; header and data do not match");
        }
    }

    // A whole number; some writers give it a decimal point.
    template <class Whole>
    bool parse(Whole& value) const {
        const auto [end, error] = std::from_chars(word().data(), word().data() + word().size(), value);
        const std::string_view rest = word().substr(static_cast<size_t>(end - word().data()));
        return error == std::errc() && (rest.empty() || (rest[0] == '.' && rest.find_first_not_of('0', 1) == std::string_view::npos));
    }

    const InputFile& file_;
    const PlyHeader& header_;
    const PlyLayout& layout_;
    const PlyTextLayout text_;
    LineReader lines_;
    PlyMesh out_;
    const PlyElement* element_ = nullptr;
    uint64_t items_ = 0;  // of the element
    std::vector<std::string_view> words_;
    size_t at_ = 0;
};

}  // namespace

Status read_ply_text(const InputFile& file, const PlyHeader& header, const MeshView& view, TriangleMesh& mesh, MeshIssues& issues) {
    const auto layout = find_ply_layout(header, file.path().string(), view.uvs);
    if (!layout) return layout.status();
    // Most files have an item a line, and where one is damaged, the line says so. What cannot be read like that may be wrapped otherwise.
    MeshIssues found;
    {
        PlyText by_lines(file, header, *layout, PlyTextLayout::lines, view, found);
        const Status status = by_lines.read();
        if (status.ok()) {
            mesh = std::move(by_lines.mesh());
            issues.add(found);
            return {};
        }
        found = {};
        by_lines.mesh() = {};
        PlyText by_words(file, header, *layout, PlyTextLayout::words, view, found);
        if (!by_words.read().ok()) return status;
        mesh = std::move(by_words.mesh());
    }
    issues.add(found);
    return {};
}

}  // namespace raypager
