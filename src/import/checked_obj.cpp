#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "import/checked_input.hpp"
#include "import/text.hpp"

namespace raypager {
namespace {

// Stands for a vertex that does not exist.
constexpr int64_t no_vertex = 0x7fffffff;

// Statements of the format that say nothing about vertices and faces. Anything else is damage: a bit flipped in "v" would silently
// renumber all later vertices.
constexpr std::string_view ignored[] = {
    "vt",  "vp",       "vc",       "g",      "o",   "s",     "mg",    "l",          "p",         "mtllib", "usemtl", "usemap", "maplib", "bevel",
    "lod", "c_interp", "d_interp", "cstype", "deg", "bmat",  "step",  "curv",       "curv2",     "surf",   "parm",   "trim",   "hole",   "scrv",
    "sp",  "end",      "con",      "call",   "csh", "ctech", "stech", "shadow_obj", "trace_obj", "res",    "cdc",    "cdp",    "bzp",    "bsp"};

struct Corner {
    int64_t vertex = no_vertex;
    int64_t normal = 0;  // 0: none
};

// Keeps "v", "vn" and "f"; faces are cut into fans of triangles with indices counted from the start of the file.
class ObjText final : public CheckedText {
public:
    using CheckedText::CheckedText;

protected:
    void rewind() override {
        CheckedText::rewind();
        vertices_ = normals_ = 0;
        joined_.clear();
    }

    Status rewrite(std::string_view line, std::string& out) override {
        if (!line.empty() && line.back() == '\\') {  // goes on in the next line
            joined_ += line.substr(0, line.size() - 1);
            joined_ += ' ';
            return joined_.size() <= (size_t{16} << 20) ? Status() : bad("a line is continued over more than 16 MiB");
        }
        if (joined_.empty()) return statement(line, out);
        joined_ += line;
        const Status status = statement(joined_, out);
        joined_.clear();
        return status;
    }

    Status finish() override {
        if (!joined_.empty()) return bad("the last line ends in a backslash; the file is truncated");
        return faces_ > 0 ? Status() : Status::failed(file_.path().string() + ": has no faces; is it a Wavefront OBJ file?");
    }

private:
    Status statement(std::string_view line, std::string& out) {
        split_words(line.substr(0, line.find('#')), words_);
        if (words_.empty()) return {};
        if (words_[0] == "v") {
            if (++vertices_ >= no_vertex) return bad("more than 2147483646 vertices");
            out += 'v';
            RAYPAGER_TRY(append_position(words_, {1, 2, 3}, out));
            out += '\n';
        } else if (words_[0] == "vn") {
            ++normals_;
            out += "vn";
            RAYPAGER_TRY(append_normal(words_, {1, 2, 3}, out));
            out += '\n';
        } else if (words_[0] == "f" || words_[0] == "fo") {
            RAYPAGER_TRY(face(out));
        } else if (std::find(std::begin(ignored), std::end(ignored), words_[0]) == std::end(ignored)) {
            return bad(fmt::format("\"{}\" is no statement of an OBJ file", clipped(words_[0])));
        }
        return {};
    }

    Status face(std::string& out) {
        if (words_.size() < 4) return bad("a face with fewer than three corners");
        Corner first, previous;
        for (size_t i = 1; i < words_.size(); ++i) {
            Corner corner;
            RAYPAGER_TRY(parse_corner(words_[i], corner));
            if (i >= 3) {
                out += 'f';
                for (const Corner& c : {first, previous, corner}) append(c, out);
                out += '\n';
                ++faces_;
            }
            if (i == 1) first = corner;
            previous = corner;
        }
        return {};
    }

    static void append(const Corner& corner, std::string& out) {
        if (corner.normal > 0)
            fmt::format_to(std::back_inserter(out), " {}//{}", corner.vertex, corner.normal);
        else
            fmt::format_to(std::back_inserter(out), " {}", corner.vertex);
    }

    // vertex, vertex/texture, vertex//normal or vertex/texture/normal; counted from 1, or backwards from the latest if negative.
    Status parse_corner(std::string_view word, Corner& corner) const {
        int64_t parts[3] = {0, 0, 0};
        size_t part = 0;
        std::string_view rest = word;
        while (true) {
            const size_t slash = std::min(rest.find('/'), rest.size());
            const auto [end, error] = std::from_chars(rest.data(), rest.data() + slash, parts[part]);
            const bool whole = error == std::errc() && end == rest.data() + slash;
            if (!whole && error != std::errc::result_out_of_range && (part == 0 || slash > 0)) return bad_corner(word);
            if (slash == rest.size()) break;
            rest.remove_prefix(slash + 1);
            if (++part == 3) return bad_corner(word);
        }
        corner.vertex = resolve(parts[0], vertices_, no_vertex);
        corner.normal = resolve(parts[2], normals_, 0);
        if (corner.normal > normals_) corner.normal = 0;
        return {};
    }

    Status bad_corner(std::string_view word) const { return bad(fmt::format("\"{}\" is no corner of a face", clipped(word))); }

    static int64_t resolve(int64_t index, int64_t count, int64_t none) {
        if (index < 0) index += count + 1;
        return index <= 0 || index > no_vertex ? none : index;
    }

    int64_t vertices_ = 0, normals_ = 0;
    std::string joined_;
};

}  // namespace

std::unique_ptr<CheckedInput> check_obj_text(const InputFile& file) { return std::make_unique<ObjText>(file); }

}  // namespace raypager
