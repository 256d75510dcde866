#include "import/obj_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numeric>
#include <unordered_map>

#include "import/index_table.hpp"
#include "import/line_reader.hpp"
#include "import/mesh_colors.hpp"
#include "import/obj_corners.hpp"
#include "import/polygons.hpp"
#include "import/text.hpp"

namespace raypager {
namespace {

// Statements of the format that say nothing about vertices, faces and materials.
constexpr std::string_view ignored_statements[] = {"vp",   "vc",       "g",        "o",      "s",   "mg",         "usemap",   "maplib", "bevel",
                                                   "lod",  "c_interp", "d_interp", "cstype", "deg", "bmat",       "step",     "parm",   "trim",
                                                   "hole", "scrv",     "sp",       "end",    "con", "call",       "csh",      "ctech",  "stech",
                                                   "cdc",  "cdp",      "bzp",      "bsp",    "res", "shadow_obj", "trace_obj"};
constexpr std::string_view undrawn_statements[] = {"p", "l", "curv", "curv2", "surf"};

constexpr uint64_t max_vertices = 0xfffffffe;

template <size_t N>
bool is_one_of(std::string_view word, const std::string_view (&words)[N]) {
    return std::find(std::begin(words), std::end(words), word) != std::end(words);
}

class ObjReader {
public:
    ObjReader(const InputFile& file, const std::array<double, 3>& origin, const WantsUvs& wants_uvs, ObjModel& model)
        : name_(file.path().string()),
          lines_(file),
          origin_(origin),
          wants_uvs_(wants_uvs),
          model_(model),
          mesh_(model.mesh),
          polygons_(model.mesh, model.issues) {}

    Status read() {
        std::string joined;  // a line that goes on in the next one
        std::string_view line;
        for (bool end = false;;) {
            RAYPAGER_TRY(lines_.next(line, end));
            if (end) break;
            const bool goes_on = take_backslash(line);
            if (joined.empty() && !goes_on) {
                RAYPAGER_TRY(statement(line));
                continue;
            }
            joined += line;
            joined += ' ';
            if (joined.size() > (size_t{16} << 20)) return lines_.bad("a line is continued over more than 16 MiB");
            if (goes_on) continue;
            RAYPAGER_TRY(statement(joined));
            joined.clear();
        }
        if (!joined.empty()) return lines_.bad("the last line ends in a backslash; the file is truncated");
        if (!any_faces_) return nothing_in_it();
        finish();
        return {};
    }

private:
    // Whether the line goes on in the next one. Comments do not.
    static bool take_backslash(std::string_view& line) {
        const size_t last = line.find_last_not_of(" \t\r\v\f");
        if (last == std::string_view::npos || line[last] != '\\' || without_comment(line).size() <= last) return false;
        line = line.substr(0, last);
        return true;
    }

    Status statement(std::string_view line) {
        if (line.starts_with("#MRGB")) return painted_colors(line), Status();
        const std::string_view text = without_comment(line);
        split_words(text, words_);
        if (words_.empty()) return {};
        const std::string_view keyword = words_[0];
        if (keyword == "v") return vertex();
        if (keyword == "vn") return normal();
        if (keyword == "vt") return uv(), Status();
        if (keyword == "f" || keyword == "fo") return face();
        if (keyword == "usemtl") return use_material(std::string(name_behind_keyword(line))), Status();
        if (keyword == "mtllib") return name_library(std::string(name_behind_keyword(line))), Status();
        if (is_one_of(keyword, undrawn_statements))
            note(not_drawn_, fmt::format("\"{}\" is no face", keyword));
        else if (!is_one_of(keyword, ignored_statements))
            note(unknown_, fmt::format("\"{}\" is no statement of an OBJ file", clipped(keyword)));
        return {};
    }

    Status numbers(std::array<double, 3>& values) const {
        for (size_t i = 0; i < 3; ++i) {
            if (i + 1 >= words_.size()) return lines_.bad("too few numbers; three coordinates are needed");
            const auto value = parse_number(words_[i + 1]);
            if (!value) return lines_.bad(fmt::format("\"{}\" is no number", clipped(words_[i + 1])));
            values[i] = *value;
        }
        return {};
    }

    // v x y z, with a weight, a colour or both: x y z w, x y z r g b, x y z w r g b or x y z r g b a.
    Status vertex() {
        if (mesh_.positions.size() >= max_vertices) return lines_.bad(fmt::format("more than {} vertices", max_vertices));
        std::array<double, 3> p = {};
        RAYPAGER_TRY(numbers(p));
        if (words_.size() >= 7) color();
        mesh_.positions.push_back(
            {static_cast<float>(p[0] - origin_[0]), static_cast<float>(p[1] - origin_[1]), static_cast<float>(p[2] - origin_[2])});
        return {};
    }

    void color() {
        std::array<float, 4> color = {NAN, NAN, NAN, NAN};
        for (size_t i = 0; i < std::min<size_t>(4, words_.size() - 4); ++i) color[i] = static_cast<float>(parse_number(words_[4 + i]).value_or(NAN));
        colors_.resize(mesh_.positions.size(), {NAN, NAN, NAN, NAN});
        colors_.push_back(color);
    }

    // "#MRGB" and eight hexadecimal digits a vertex: mask, red, green, blue. ZBrush writes them behind the vertices.
    void painted_colors(std::string_view line) {
        split_words(line.substr(5), words_);
        for (const std::string_view word : words_)
            for (size_t at = 0; at + 8 <= word.size(); at += 8) {
                uint32_t mrgb = 0;
                const char* const begin = word.data() + at;
                if (std::from_chars(begin, begin + 8, mrgb, 16).ptr != begin + 8) return;
                painted_.push_back((mrgb >> 16 & 255) | (mrgb & 0xff00) | (mrgb & 255) << 16);
            }
    }

    Status normal() {
        std::array<double, 3> n = {};
        RAYPAGER_TRY(numbers(n));
        corner_attributes_.add_normal({static_cast<float>(n[0]), static_cast<float>(n[1]), static_cast<float>(n[2])});
        return {};
    }

    // vt u, vt u v or vt u v w. What is no number is found when it is used.
    void uv() {
        if (!wants_uvs_) return;
        const auto coordinate = [this](size_t i) { return i < words_.size() ? static_cast<float>(parse_number(words_[i]).value_or(NAN)) : 0.0f; };
        corner_attributes_.add_uv({coordinate(1), coordinate(2)});
    }

    Status face() {
        any_faces_ = true;
        corners_.clear();
        corner_uvs_.clear();
        corner_normals_.clear();
        for (size_t i = 1; i < words_.size(); ++i) {
            int64_t parts[3] = {};
            if (!parse_corner(words_[i], parts)) return lines_.bad(fmt::format("\"{}\" is no corner of a face", clipped(words_[i])));
            corners_.push_back(resolve(parts[0], mesh_.positions.size()));
            corner_uvs_.push_back(wants_uvs_ ? resolve(parts[1], corner_attributes_.uvs()) : RP_NONE);
            corner_normals_.push_back(resolve(parts[2], corner_attributes_.normals()));
        }
        if (model_.runs.empty()) use_material("");
        polygons_.add(corners_, corner_attributes_.attributes(polygons_.attributes(), corner_uvs_, corner_normals_));
        return {};
    }

    // vertex, vertex/texture, vertex//normal or vertex/texture/normal.
    static bool parse_corner(std::string_view word, int64_t (&parts)[3]) {
        const char *at = word.data(), *const end = word.data() + word.size();
        for (size_t part = 0;; ++at) {
            const auto [stop, error] = std::from_chars(at, end, parts[part]);
            if (error == std::errc::result_out_of_range) parts[part] = 0;
            if (stop == at && (part == 0 || (at != end && *at != '/'))) return false;
            at = stop;
            if (at == end) break;
            if (*at != '/' || ++part == 3) return false;
        }
        return true;
    }

    // Counted from 1, or backwards from the latest if negative.
    static uint32_t resolve(int64_t index, uint64_t count) {
        if (index < 0) index += static_cast<int64_t>(count) + 1;
        return index <= 0 || index > static_cast<int64_t>(max_vertices) ? RP_NONE : static_cast<uint32_t>(index - 1);
    }

    void use_material(const std::string& name) {
        const auto next = static_cast<uint32_t>(model_.materials.size());
        const auto hash = [](const std::string& text) { return uint64_t{std::hash<std::string>()(text)}; };
        const uint32_t found = known_materials_.find_or_add(
            hash(name), next, [&](uint32_t i) { return hash(model_.materials[i]); }, [&](uint32_t i) { return model_.materials[i] == name; });
        if (found == next) model_.materials.push_back(name);
        if (!model_.runs.empty() && model_.runs.back().first == mesh_.triangles.size()) model_.runs.pop_back();
        if (model_.runs.empty() || model_.runs.back().material != found) model_.runs.push_back({mesh_.triangles.size(), found});
    }

    void name_library(const std::string& name) {
        if (!name.empty() && std::find(model_.libraries.begin(), model_.libraries.end(), name) == model_.libraries.end() &&
            model_.libraries.size() < 1000)
            model_.libraries.push_back(name);
    }

    // Lines of one kind that say nothing that is used.
    struct Lines {
        uint64_t count = 0, first = 0;
        std::string what;  // of the first
    };
    void note(Lines& lines, const std::string& what) const {
        if (lines.count++ > 0) return;
        lines.first = lines_.line();
        lines.what = what;
    }
    std::string say(const Lines& lines, const char* rest) const {
        return fmt::format("{}:{}: {}; {} such {} {}", name_, lines.first, lines.what, lines.count, lines.count == 1 ? "line is" : "lines are", rest);
    }

    Status nothing_in_it() const {
        if (not_drawn_.count > 0) return Status::failed(say(not_drawn_, "all there is: points, lines and free-form surfaces cannot be drawn"));
        if (unknown_.count > 0) return Status::failed(say(unknown_, "there, and no faces; is it a Wavefront OBJ file?"));
        return Status::failed(name_ + ": has no faces; is it a Wavefront OBJ file?");
    }

    void finish() {
        if (unknown_.count > 0) model_.issues.warn("obj unknown", say(unknown_, "skipped"));
        if (not_drawn_.count > 0)
            model_.issues.warn("obj not drawn", say(not_drawn_, "skipped: points, lines and free-form surfaces cannot be drawn"));
        polygons_.cut_concave();
        color_vertices();
        model_.sort_runs();
        corner_attributes_.split(mesh_, polygons_.attributes(), corner_attributes_.uvs() > 0 && wants_uvs_(model_.libraries));
    }

    void color_vertices() {
        if (!painted_.empty()) {
            painted_.resize(mesh_.positions.size(), RP_NONE);
            mesh_.colors = std::move(painted_);
        }
        if (colors_.empty()) return;
        // A fourth number is the weight of the position if it is 1 everywhere while the last one, then blue, is not; else the last one is alpha.
        bool weight = true, alpha = true;
        for (const auto& c : colors_) {
            if (std::isnan(c[0])) continue;
            weight = weight && c[0] == 1 && !std::isnan(c[3]);
            alpha = alpha && c[3] == 1;
        }
        const size_t first = weight && !alpha ? 1 : 0;
        double largest = 0;
        for (const auto& c : colors_)
            for (size_t i = 0; i < 3; ++i)
                if (std::isfinite(c[first + i])) largest = std::max<double>(largest, c[first + i]);
        const double scale = color_scale(largest);
        mesh_.colors.resize(mesh_.positions.size(), RP_NONE);
        for (size_t i = 0; i < colors_.size(); ++i) {
            const float* const c = &colors_[i][first];
            if (std::isfinite(c[0]) && std::isfinite(c[1]) && std::isfinite(c[2]))
                mesh_.colors[i] = pack_color(c[0] / scale, c[1] / scale, c[2] / scale);
        }
    }

    const std::string name_;
    LineReader lines_;
    const std::array<double, 3> origin_;
    const WantsUvs& wants_uvs_;
    ObjModel& model_;
    TriangleMesh& mesh_;
    PolygonBuilder polygons_;
    bool any_faces_ = false;
    ObjCorners corner_attributes_;
    IndexTable known_materials_;
    std::vector<std::array<float, 4>> colors_;  // what follows the coordinates; up to the last vertex that has it
    std::vector<uint32_t> painted_;
    Lines unknown_, not_drawn_;
    std::vector<std::string_view> words_;  // scratch, as are these:
    std::vector<uint32_t> corners_, corner_uvs_, corner_normals_;
};

// Numbers the vertices of a part in the order in which they come: by a table of all between the least and the most, but where the part has few of
// them. Of many parts the tables would take time without bound.
class PartNumbers {
public:
    PartNumbers(uint32_t least, uint32_t most, uint64_t triangles) : least_(least) {
        if (least <= most && most - least <= 64 * triangles) table_.assign(size_t{most} - least + 1, RP_NONE);
    }
    // next: its number if it is new.
    uint32_t of(uint32_t vertex, uint32_t next) {
        uint32_t& number = table_.empty() ? few_.try_emplace(vertex, RP_NONE).first->second : table_[vertex - least_];
        if (number == RP_NONE) number = next;
        return number;
    }

private:
    uint32_t least_;
    std::vector<uint32_t> table_;
    std::unordered_map<uint32_t, uint32_t> few_;
};

}  // namespace

void ObjModel::sort_runs() {
    runs_by_material_.resize(runs.size());
    std::iota(runs_by_material_.begin(), runs_by_material_.end(), uint64_t{0});
    std::stable_sort(runs_by_material_.begin(), runs_by_material_.end(),
                     [this](uint64_t a, uint64_t b) { return runs[a].material < runs[b].material; });
}

std::span<const uint64_t> ObjModel::runs_of(uint32_t material) const {
    const auto first =
        std::partition_point(runs_by_material_.begin(), runs_by_material_.end(), [&](uint64_t run) { return runs[run].material < material; });
    const auto end = std::partition_point(first, runs_by_material_.end(), [&](uint64_t run) { return runs[run].material == material; });
    return {first, end};
}

uint64_t ObjModel::end_of_run(uint64_t run) const { return run + 1 < runs.size() ? runs[run + 1].first : mesh.triangles.size(); }

uint64_t ObjModel::bytes() const {
    return mesh.positions.size() * sizeof(Float3) + mesh.normals.size() * sizeof(Float3) + mesh.colors.size() * 4 + mesh.uvs.size() * sizeof(Float2) +
           mesh.triangles.size() * sizeof(Triangle);
}

Status read_obj(const InputFile& file, const std::array<double, 3>& origin, const WantsUvs& wants_uvs, ObjModel& model) {
    return ObjReader(file, origin, wants_uvs, model).read();
}

TriangleMesh part_of_obj(const ObjModel& model, uint32_t material, uint32_t plain) {
    TriangleMesh part;
    const auto each_triangle = [&](const auto& visit) {
        for (const uint64_t run : model.runs_of(material))
            for (uint64_t t = model.runs[run].first; t < model.end_of_run(run); ++t) visit(model.mesh.triangles[t]);
    };
    uint32_t least = RP_NONE, most = 0;
    uint64_t count = 0;
    each_triangle([&](const Triangle& t) {
        ++count;
        for (const uint32_t v : t) {
            if (v >= model.mesh.positions.size()) continue;
            least = std::min(least, v);
            most = std::max(most, v);
        }
    });
    part.triangles.reserve(count);
    PartNumbers numbers(least, most, count);
    bool colored = false;
    each_triangle([&](const Triangle& t) {
        Triangle& mine = part.triangles.emplace_back(Triangle{RP_NONE, RP_NONE, RP_NONE});
        for (size_t k = 0; k < 3; ++k) {
            if (t[k] >= model.mesh.positions.size()) continue;
            const auto next = static_cast<uint32_t>(part.positions.size());
            const uint32_t number = numbers.of(t[k], next);
            if (number == next) {
                part.positions.push_back(model.mesh.positions[t[k]]);
                if (!model.mesh.normals.empty()) part.normals.push_back(model.mesh.normals[t[k]]);
                if (!model.mesh.colors.empty()) part.colors.push_back(model.mesh.colors[t[k]]);
                if (!model.mesh.uvs.empty()) part.uvs.push_back(model.mesh.uvs[t[k]]);
                colored = colored || (!model.mesh.colors.empty() && model.mesh.colors[t[k]] != RP_NONE);
            }
            mine[k] = number;
        }
    });
    if (!colored) part.colors.clear();
    std::replace(part.colors.begin(), part.colors.end(), RP_NONE, plain);
    return part;
}

}  // namespace raypager
