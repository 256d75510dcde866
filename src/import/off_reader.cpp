#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>

#include "import/line_reader.hpp"
#include "import/mesh_colors.hpp"
#include "import/mesh_readers.hpp"
#include "import/polygons.hpp"
#include "import/text.hpp"

namespace raypager {
namespace {

// How the items of a file are told apart: each begins on a line of its own, and what follows it there is its colour; or they are words one after
// the other, wherever the lines end.
enum class OffLayout { lines, words };

std::optional<uint64_t> parse_whole(std::string_view word) {
    uint64_t value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    return error == std::errc() && end == word.data() + word.size() ? std::optional(value) : std::nullopt;
}

class OffReader {
public:
    OffReader(const InputFile& file, OffLayout layout, const MeshView& view, TriangleMesh& mesh, MeshIssues& issues)
        : file_(file), lines_(file), layout_(layout), origin_(view.origin), uvs_(view.uvs), mesh_(mesh), issues_(issues), polygons_(mesh, issues) {}

    Status read() {
        RAYPAGER_TRY(header());
        mesh_.positions.reserve(vertex_count_);
        mesh_.triangles.reserve(face_count_);
        for (; vertices_ < vertex_count_; ++vertices_) RAYPAGER_TRY(vertex());
        for (; faces_ < face_count_; ++faces_) RAYPAGER_TRY(face());
        RAYPAGER_TRY(more(1, true));
        if (at_ < words_.size())
            issues_.warn("off tail", lines_.bad("text after the last face is passed over; counts and data may not match").message());
        finish();
        return {};
    }

private:
    // Makes the next `count` words available from at_ on, from more lines if need be. At the end of the file there may be fewer, which is an error
    // unless it may end there.
    Status more(size_t count, bool may_end = false) {
        while (words_.size() - at_ < count) {
            keep_rest();
            std::string_view line;
            bool end = false;
            RAYPAGER_TRY(lines_.next(line, end));
            if (end) return may_end ? Status() : truncated();
            split_words(without_comment(line), line_words_);
            words_.insert(words_.end(), line_words_.begin(), line_words_.end());
        }
        return {};
    }

    // The words that are left outlive the line that they are in.
    void keep_rest() {
        std::vector<std::string> kept;
        for (size_t i = at_; i < words_.size(); ++i) kept.emplace_back(words_[i]);
        kept_.swap(kept);
        words_.assign(kept_.begin(), kept_.end());
        at_ = 0;
    }

    Status truncated() const {
        if (!has_counts_) return Status::failed(file_.path().string() + ": ends before its counts; it is truncated or no OFF file");
        return Status::failed(fmt::format("{}: ends after {} of {} vertices and {} of {} faces; it is truncated", file_.path().string(), vertices_,
                                          vertex_count_, faces_, face_count_));
    }

    // [ST][C][N][4][n]OFF and the counts, which may follow on the same line, even without a blank. Some writers leave out the word.
    Status header() {
        RAYPAGER_TRY(more(1));
        const std::string_view word = words_[at_];
        const size_t off = word.find("OFF");
        if (off == std::string_view::npos) {
            if (words_.size() < 2 || words_.size() > 3 || !parse_whole(word)) return lines_.bad("does not start with \"OFF\": not an OFF file");
        } else {
            const std::string_view prefix = word.substr(0, off);
            if (prefix.find_first_not_of("STCN") != std::string_view::npos)
                return lines_.bad(fmt::format("\"{}\" is a kind of OFF that cannot be read here; only three-dimensional ones can", clipped(word)));
            has_texture_ = prefix.find("ST") != std::string_view::npos;
            has_color_ = prefix.find('C') != std::string_view::npos;
            has_normal_ = prefix.find('N') != std::string_view::npos;
            words_[at_].remove_prefix(off + 3);
            if (words_[at_].empty()) ++at_;
        }
        RAYPAGER_TRY(more(1));
        if (words_[at_] == "BINARY") return lines_.bad("binary OFF cannot be read here; convert it to text, or to PLY");
        return counts();
    }

    Status counts() {
        RAYPAGER_TRY(more(2));
        const auto vertices = parse_whole(words_[at_]), faces = parse_whole(words_[at_ + 1]);
        if (!vertices || !faces) return lines_.bad("expected the numbers of vertices, faces and edges");
        vertex_count_ = *vertices;
        face_count_ = *faces;
        if (vertex_count_ == 0 || face_count_ == 0) return lines_.bad("has no vertices or no faces");
        // A vertex takes six bytes at least ("0 0 0" and a blank), a face two.
        if (vertex_count_ > file_.size() / 6 || face_count_ > file_.size() / 2)
            return lines_.bad(fmt::format("{} vertices and {} faces cannot be in {} bytes; the file is truncated or damaged", vertex_count_,
                                          face_count_, file_.size()));
        if (vertex_count_ > 0xfffffffe) return lines_.bad("more than 4294967294 vertices");
        has_counts_ = true;
        at_ += 2;
        // The number of edges says nothing. It may be missing, or be on a line of its own.
        const bool is_next = at_ < words_.size();
        RAYPAGER_TRY(more(1));
        if (is_next || layout_ == OffLayout::words || (words_.size() == at_ + 1 && parse_whole(words_[at_]))) ++at_;
        if (!is_next && layout_ == OffLayout::lines) return {};
        if (layout_ == OffLayout::lines && at_ < words_.size()) return lines_.bad("expected the numbers of vertices, faces and edges, and no more");
        return {};
    }

    Status number(double& value) {
        RAYPAGER_TRY(more(1));
        const auto parsed = parse_number(words_[at_]);
        if (!parsed) return lines_.bad(fmt::format("\"{}\" is no number", clipped(words_[at_])));
        ++at_;
        value = *parsed;
        return {};
    }

    // x y z, then what the header has announced: normal, colour, texture. A colour may also come unannounced.
    Status vertex() {
        std::array<double, 3> p = {}, n = {};
        for (double& x : p) RAYPAGER_TRY(number(x));
        for (size_t i = 0; i < 3 && has_normal_; ++i) RAYPAGER_TRY(number(n[i]));
        mesh_.positions.push_back(
            {static_cast<float>(p[0] - origin_[0]), static_cast<float>(p[1] - origin_[1]), static_cast<float>(p[2] - origin_[2])});
        if (has_normal_) mesh_.normals.push_back({static_cast<float>(n[0]), static_cast<float>(n[1]), static_cast<float>(n[2])});
        if (layout_ == OffLayout::lines) {
            const size_t texture = has_texture_ ? std::min<size_t>(2, words_.size() - at_) : 0;
            take_color(vertex_colors_, mesh_.positions.size() - 1, words_.size() - at_ - texture);
            at_ = words_.size() - texture;
            if (has_texture_) {
                // Where there are too few numbers, these are the colour's or none.
                std::array<double, 2> uv = {};
                for (size_t i = 0; i < 2 && texture == 2; ++i) uv[i] = parse_number(words_[at_ + i]).value_or(NAN);
                add_uv(uv);
            }
            at_ = words_.size();
            return {};
        }
        if (has_color_) {
            RAYPAGER_TRY(more(4));
            take_color(vertex_colors_, mesh_.positions.size() - 1, 4);
            at_ += 4;
        }
        if (!has_texture_) return {};
        std::array<double, 2> uv = {};
        for (double& coordinate : uv) RAYPAGER_TRY(number(coordinate));
        add_uv(uv);
        return {};
    }

    void add_uv(const std::array<double, 2>& uv) {
        if (uvs_) mesh_.uvs.push_back({static_cast<float>(uv[0]), static_cast<float>(uv[1])});
    }

    Status face() {
        RAYPAGER_TRY(more(1));
        const auto corners = parse_whole(words_[at_]);
        if (!corners) return lines_.bad(fmt::format("\"{}\" is no number of corners", clipped(words_[at_])));
        if (*corners > file_.size() / 2) return lines_.bad(fmt::format("a face of {} corners cannot be in {} bytes", *corners, file_.size()));
        ++at_;
        corners_.clear();
        for (uint64_t i = 0; i < *corners; ++i) {
            RAYPAGER_TRY(more(1));
            int64_t index = 0;
            const std::string_view word = words_[at_++];
            const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), index);
            if (error != std::errc() || end != word.data() + word.size()) return lines_.bad(fmt::format("\"{}\" is no vertex number", clipped(word)));
            corners_.push_back(index < 0 || index > 0xfffffffe ? RP_NONE : static_cast<uint32_t>(index));
        }
        if (layout_ == OffLayout::lines) {
            const size_t numbers = words_.size() - at_;
            map_indices_ += numbers == 1;
            if (numbers > 1) take_color(face_colors_, faces_, numbers);
            at_ = words_.size();
        }
        // Colours get their final form when the largest is known: until then, their place in the list stands for them.
        attributes_.assign(face_colors_.of.size() > faces_ ? corners_.size() : 0, static_cast<uint32_t>(faces_));
        polygons_.add(corners_, attributes_);
        return {};
    }

    // Numbers of colours as the file has them: whole ones to 255, or fractions of 1.
    struct Colors {
        std::vector<std::array<float, 3>> of;  // by number of item, up to the last one that has any; NAN: none
        double largest = 0;
    };

    // From at_ on there are so many numbers: three, or four with alpha, are a colour.
    void take_color(Colors& colors, size_t item, size_t numbers) const {
        if (numbers < 3) return;
        std::array<float, 3> color = {};
        for (size_t i = 0; i < 3; ++i) {
            const auto value = parse_number(words_[at_ + i]);
            if (!value || !std::isfinite(*value) || *value < 0) return;
            color[i] = static_cast<float>(*value);
        }
        colors.of.resize(item, {NAN, NAN, NAN});
        colors.of.push_back(color);
        colors.largest = std::max<double>({colors.largest, color[0], color[1], color[2]});
    }

    static uint32_t packed(const Colors& colors, size_t item) {
        if (item >= colors.of.size() || std::isnan(colors.of[item][0])) return RP_NONE;
        const double scale = color_scale(colors.largest);
        const auto& c = colors.of[item];
        return pack_color(c[0] / scale, c[1] / scale, c[2] / scale);
    }

    void finish() {
        polygons_.cut_concave();
        if (!vertex_colors_.of.empty()) {
            mesh_.colors.resize(mesh_.positions.size());
            for (size_t i = 0; i < mesh_.colors.size(); ++i) {
                const uint32_t color = packed(vertex_colors_, i);
                mesh_.colors[i] = color == RP_NONE ? no_color : color;
            }
        }
        for (Triangle& t : polygons_.attributes())
            for (uint32_t& face : t) face = packed(face_colors_, face);
        color_corners(mesh_, polygons_);
        if (map_indices_ > 0)
            issues_.warn("off color map", fmt::format("{}: colours of {} {} are numbers in a colour map that is not in the file; they are not used",
                                                      file_.path().string(), map_indices_, map_indices_ == 1 ? "face" : "faces"));
    }

    const InputFile& file_;
    LineReader lines_;
    const OffLayout layout_;
    const std::array<double, 3> origin_;
    const bool uvs_;
    TriangleMesh& mesh_;
    MeshIssues& issues_;
    PolygonBuilder polygons_;
    bool has_counts_ = false, has_normal_ = false, has_color_ = false, has_texture_ = false;
    uint64_t vertex_count_ = 0, face_count_ = 0, vertices_ = 0, faces_ = 0, map_indices_ = 0;
    Colors vertex_colors_, face_colors_;
    std::vector<std::string_view> words_, line_words_;  // words_: from at_ on, those that come next
    std::vector<std::string> kept_;                     // what some of them are in
    size_t at_ = 0;
    std::vector<uint32_t> corners_, attributes_;  // scratch
};

}  // namespace

Status read_off(const InputFile& file, const MeshView& view, TriangleMesh& mesh, MeshIssues& issues) {
    // Most files have an item a line, and where one is damaged, the line says so. What cannot be read like that may be laid out otherwise.
    MeshIssues found;
    const Status by_lines = OffReader(file, OffLayout::lines, view, mesh, found).read();
    if (!by_lines.ok()) {
        TriangleMesh other;
        found = {};
        if (!OffReader(file, OffLayout::words, view, other, found).read().ok()) return by_lines;
        mesh = std::move(other);
    }
    issues.add(found);
    return {};
}

}  // namespace raypager
