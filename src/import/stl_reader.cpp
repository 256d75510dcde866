#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "import/index_table.hpp"
#include "import/line_reader.hpp"
#include "import/mesh_colors.hpp"
#include "import/mesh_readers.hpp"
#include "import/polygons.hpp"
#include "import/stl_layout.hpp"
#include "import/text.hpp"

namespace raypager {
namespace {

// Corners with equal coordinates, and where there are colours with equal ones, become one vertex.
class CornerMerger {
public:
    CornerMerger(const std::array<double, 3>& origin, TriangleMesh& mesh) : origin_(origin), mesh_(mesh) {}

    uint32_t vertex(const std::array<double, 3>& p, uint32_t color = 0) {
        const Float3 position = {static_cast<float>(p[0] - origin_[0]), static_cast<float>(p[1] - origin_[1]), static_cast<float>(p[2] - origin_[2])};
        const auto next = static_cast<uint32_t>(mesh_.positions.size());
        const Bits wanted = bits(position, color);
        const uint32_t found = known_.find_or_add(
            hash(wanted), next, [&](uint32_t i) { return hash(bits_of(i)); }, [&](uint32_t i) { return bits_of(i) == wanted; });
        if (found != next) return found;
        mesh_.positions.push_back(position);
        if (has_colors_) mesh_.colors.push_back(color);
        return next;
    }
    // Before the first vertex.
    void use_colors() { has_colors_ = true; }

private:
    using Bits = std::array<uint32_t, 4>;
    static Bits bits(const Float3& p, uint32_t color) {
        // + 0: both zeros are equal.
        return {std::bit_cast<uint32_t>(p.x + 0.0f), std::bit_cast<uint32_t>(p.y + 0.0f), std::bit_cast<uint32_t>(p.z + 0.0f), color};
    }
    Bits bits_of(uint32_t i) const { return bits(mesh_.positions[i], has_colors_ ? mesh_.colors[i] : 0); }
    static uint64_t hash(const Bits& b) {
        return ((uint64_t{b[0]} << 32 | b[1]) * 0x9e3779b97f4a7c15u) ^ ((uint64_t{b[2]} << 32 | b[3]) * 0xc2b2ae3d27d4eb4fu);
    }

    const std::array<double, 3> origin_;
    TriangleMesh& mesh_;
    bool has_colors_ = false;
    IndexTable known_;
};

bool same(std::string_view word, std::string_view keyword) {
    return word.size() == keyword.size() && std::equal(word.begin(), word.end(), keyword.begin(), [](char a, char b) { return (a | 0x20) == b; });
}

// solid NAME { facet normal n n n / outer loop / three of vertex x y z / endloop / endfacet } endsolid NAME, as words: wherever lines end.
class StlText {
public:
    StlText(const InputFile& file, const std::array<double, 3>& origin, TriangleMesh& mesh, MeshIssues& issues)
        : name_(file.path().string()), lines_(file), corners_(origin, mesh), issues_(issues), polygons_(mesh, issues) {}

    Status read() {
        while (true) {
            RAYPAGER_TRY(next());
            if (ended_) break;
            RAYPAGER_TRY(top_level());
        }
        if (!any_facets_) return Status::failed(name_ + ": has no triangles");
        if (open_facets_) issues_.warn("stl no endsolid", fmt::format("{}: ends without endsolid; the file may be truncated", name_));
        polygons_.cut_concave();
        return {};
    }

private:
    Status next() {
        ++at_;
        while (at_ >= words_.size()) {
            std::string_view line;
            RAYPAGER_TRY(lines_.next(line, ended_));
            if (ended_) return {};
            split_words(line, words_);
            at_ = 0;
        }
        return {};
    }
    std::string_view word() const { return words_[at_]; }
    bool is(std::string_view keyword) const { return same(words_[at_], keyword); }
    // "endloop", or "end loop".
    bool is_end_of(std::string_view what) const {
        if (word().size() == 3 + what.size() && same(word().substr(0, 3), "end")) return same(word().substr(3), what);
        return is("end") && at_ + 1 < words_.size() && same(words_[at_ + 1], what);
    }
    void pass_end() { at_ += is("end"); }

    Status expected(const char* what) const {
        if (ended_) return lines_.bad(fmt::format("the file ends where {} is expected; it is truncated", what));
        return lines_.bad(fmt::format("expected {} instead of \"{}\"", what, clipped(word())));
    }

    Status top_level() {
        if (is("solid")) {
            in_solid_ = true;
            skip_name();
            return {};
        }
        if (is_end_of("solid")) {
            pass_end();
            in_solid_ = open_facets_ = false;
            skip_name();
            return {};
        }
        if (is("facet") && (in_solid_ || any_facets_)) return facet();
        return expected(in_solid_ ? "facet or endsolid" : "solid");
    }

    // The rest of the line; but where the whole file is one line, up to the next facet or the end of the solid.
    void skip_name() {
        while (at_ + 1 < words_.size()) {
            const std::string_view next = words_[at_ + 1];
            if (same(next, "facet") && at_ + 2 < words_.size() && same(words_[at_ + 2], "normal")) return;
            if (same(next, "endsolid") || (!in_solid_ && same(next, "solid") && at_ + 2 < words_.size())) return;
            ++at_;
        }
    }

    Status facet() {
        // The normal follows from the corners.
        do RAYPAGER_TRY(next());
        while (!ended_ && (is("normal") || parse_number(word())));
        if (ended_ || !is("outer")) return expected("outer loop");
        RAYPAGER_TRY(next());
        if (ended_ || !is("loop")) return expected("outer loop");
        loop_.clear();
        while (true) {
            RAYPAGER_TRY(next());
            if (!ended_ && is_end_of("loop")) break;
            if (ended_ || !is("vertex")) return expected(loop_.size() < 3 ? "vertex" : "endloop");
            RAYPAGER_TRY(vertex());
        }
        pass_end();
        polygons_.add(loop_);
        RAYPAGER_TRY(next());
        if (ended_ || !is_end_of("facet")) return expected("endfacet");
        pass_end();
        any_facets_ = open_facets_ = true;
        return {};
    }

    Status vertex() {
        std::array<double, 3> p = {};
        for (double& x : p) {
            RAYPAGER_TRY(next());
            if (ended_) return expected("a coordinate");
            const auto value = parse_number(word());
            if (!value) return lines_.bad(fmt::format("\"{}\" is no number", clipped(word())));
            x = *value;
        }
        loop_.push_back(corners_.vertex(p));
        return {};
    }

    const std::string name_;
    LineReader lines_;
    CornerMerger corners_;
    MeshIssues& issues_;
    PolygonBuilder polygons_;
    bool ended_ = false, in_solid_ = false, any_facets_ = false;
    bool open_facets_ = false;             // since the last endsolid
    std::vector<std::string_view> words_;  // of a line
    size_t at_ = 0;
    std::vector<uint32_t> loop_;
};

// Colours in the two bytes behind each triangle, in one of two fashions.
class StlColors {
public:
    explicit StlColors(std::string_view header) {
        // Materialise: "COLOR=" and four bytes in the header are the colour of all triangles that have not their own.
        const size_t at = header.find("COLOR=");
        if (at == std::string_view::npos || at + 10 > header.size()) return;
        const auto byte = [&](size_t i) { return uint32_t{static_cast<uint8_t>(header[at + 6 + i])}; };
        plain_ = byte(0) | byte(1) << 8 | byte(2) << 16;
        in_header_ = true;
    }
    bool in_header() const { return in_header_; }
    // VisCAM and SolidView set the highest bit where there is a colour; Materialise clears it.
    bool has_color(uint16_t attributes) const { return (attributes >> 15 != 0) != in_header_; }
    uint32_t color(uint16_t attributes) const {
        if (!has_color(attributes)) return plain_;
        const auto part = [&](int shift) { return (attributes >> shift & 31u) * 255u / 31u; };
        return in_header_ ? part(0) | part(5) << 8 | part(10) << 16 : part(10) | part(5) << 8 | part(0) << 16;
    }

private:
    bool in_header_ = false;
    uint32_t plain_ = no_color;
};

Status each_piece(const InputFile& file, uint64_t triangles, const std::function<void(const std::byte*, size_t)>& visit) {
    constexpr uint64_t at_once = 4096;
    std::vector<std::byte> bytes;
    for (uint64_t i = 0; i < triangles; i += at_once) {
        const auto count = static_cast<size_t>(std::min(at_once, triangles - i));
        bytes.resize(count * stl_triangle_bytes);
        RAYPAGER_TRY(file.read(stl_header_bytes + i * stl_triangle_bytes, bytes));
        visit(bytes.data(), count);
    }
    return {};
}

uint16_t attributes_of(const std::byte* triangle) {
    uint16_t attributes = 0;
    std::memcpy(&attributes, triangle + 48, 2);
    return attributes;
}

Status read_stl_binary(const InputFile& file, const StlLayout& layout, const std::array<double, 3>& origin, TriangleMesh& mesh, MeshIssues& issues) {
    std::string header(80, '\0');
    RAYPAGER_TRY(file.read(0, std::as_writable_bytes(std::span(header))));
    const StlColors colors(header);
    bool colored = colors.in_header();
    if (!colored)
        RAYPAGER_TRY(each_piece(file, layout.triangles, [&](const std::byte* triangles, size_t count) {
            for (size_t i = 0; i < count && !colored; ++i) colored = colors.has_color(attributes_of(triangles + i * stl_triangle_bytes));
        }));
    CornerMerger corners(origin, mesh);
    if (colored) corners.use_colors();
    mesh.triangles.reserve(layout.triangles);
    RAYPAGER_TRY(each_piece(file, layout.triangles, [&](const std::byte* triangles, size_t count) {
        for (size_t i = 0; i < count; ++i, triangles += stl_triangle_bytes) {
            std::array<float, 9> p;
            std::memcpy(p.data(), triangles + 12, sizeof p);
            const uint32_t color = colored ? colors.color(attributes_of(triangles)) : 0;
            Triangle& t = mesh.triangles.emplace_back();
            for (size_t k = 0; k < 3; ++k) t[k] = corners.vertex({p[3 * k], p[3 * k + 1], p[3 * k + 2]}, color);
        }
    }));
    if (!layout.warning.empty()) issues.warn("stl count", layout.warning);
    return {};
}

}  // namespace

Status read_stl(const InputFile& file, const std::array<double, 3>& origin, TriangleMesh& mesh, MeshIssues& issues) {
    const auto layout = find_stl_layout(file);
    if (!layout) return layout.status();
    return layout->binary ? read_stl_binary(file, *layout, origin, mesh, issues) : StlText(file, origin, mesh, issues).read();
}

}  // namespace raypager
