#include <fmt/format.h>

#include "import/checked_input.hpp"
#include "import/text.hpp"

namespace raypager {
namespace {

// Shows a file with the plainest of headers: positions, normals if there are, and polygons. One line is one item.
class PlyText final : public CheckedText {
public:
    PlyText(const InputFile& file, const PlyHeader& header, const PlyLayout& layout) : CheckedText(file), header_(header), layout_(layout) {}

protected:
    Status rewrite(std::string_view line, std::string& out) override {
        if (lines_ < header_.lines) {
            if (++lines_ == header_.lines) show_header(out);
            return {};
        }
        split_words(line, words_);
        if (words_.empty()) return {};
        while (element_ < header_.elements.size() && items_ == header_.elements[element_].count) next_element();
        if (element_ == header_.elements.size()) return bad("text after the last element; header and data do not match");
        ++items_;
        return item(header_.elements[element_], out);
    }

    Status finish() override {
        while (element_ < header_.elements.size() && items_ == header_.elements[element_].count) next_element();
        if (element_ == header_.elements.size()) return {};
        const PlyElement& element = header_.elements[element_];
        return Status::failed(fmt::format("{}: ends after {} of {} items of \"{}\"; it is truncated", file_.path().string(), items_, element.count,
                                          clipped(element.name)));
    }

private:
    void next_element() {
        ++element_;
        items_ = 0;
    }

    void show_header(std::string& out) const {
        fmt::format_to(std::back_inserter(out), "ply\nformat ascii 1.0\nelement vertex {}\n", layout_.vertices->count);
        out += "property float x\nproperty float y\nproperty float z\n";
        if (layout_.normal) out += "property float nx\nproperty float ny\nproperty float nz\n";
        fmt::format_to(std::back_inserter(out), "element face {}\nproperty list uchar int vertex_indices\nend_header\n", layout_.faces->count);
    }

    // Finds where each property of the item starts among the words; a list is its length and then its values.
    Status item(const PlyElement& element, std::string& out) {
        starts_.clear();
        size_t at = 0;
        for (const PlyProperty& property : element.properties) {
            starts_.push_back(at);
            if (at >= words_.size()) return bad(fmt::format("too few values for an item of \"{}\"", clipped(element.name)));
            uint64_t values = 0;
            if (property.count_type && !parse_count(words_[at], values))
                return bad(fmt::format("\"{}\" is no length of a list", clipped(words_[at])));
            if (values >= words_.size() - at) return bad(fmt::format("a list of {} values has only {}", values, words_.size() - at - 1));
            at += 1 + values;
        }
        if (at != words_.size()) return bad(fmt::format("too many values for an item of \"{}\"", clipped(element.name)));
        if (&element == layout_.vertices) return vertex(out);
        if (&element == layout_.faces) return face(out);
        return {};
    }

    Status vertex(std::string& out) {
        RAYPAGER_TRY(append_position(words_, {starts_[layout_.position[0]], starts_[layout_.position[1]], starts_[layout_.position[2]]}, out));
        if (layout_.normal) {
            const auto& n = *layout_.normal;
            RAYPAGER_TRY(append_normal(words_, {starts_[n[0]], starts_[n[1]], starts_[n[2]]}, out));
        }
        out += '\n';
        return {};
    }

    Status face(std::string& out) {
        const size_t at = starts_[layout_.indices];
        uint64_t corners = 0;
        if (!parse_count(words_[at], corners)) return bad("no number of corners");
        fmt::format_to(std::back_inserter(out), "{}", corners);
        RAYPAGER_TRY(append_indices(std::span(words_).subspan(at + 1, corners), out));
        out += '\n';
        ++faces_;
        return {};
    }

    const PlyHeader& header_;
    const PlyLayout& layout_;
    uint64_t lines_ = 0, items_ = 0;
    size_t element_ = 0;
    std::vector<size_t> starts_;
};

}  // namespace

std::unique_ptr<CheckedInput> check_ply_text(const InputFile& file, const PlyHeader& header, const PlyLayout& layout) {
    return std::make_unique<PlyText>(file, header, layout);
}

}  // namespace raypager
