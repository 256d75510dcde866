#include "import/vertex_points.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <vector>

#include "import/line_reader.hpp"
#include "import/text.hpp"

namespace raypager {
namespace {

constexpr size_t max_vertex_words = 16;
constexpr size_t scanned_at_once = size_t{1} << 20;

// Where vertices are, and what is in their lines.
struct VertexLines {
    uint64_t offset = 0, line = 1;   // of the first line
    uint64_t count = 0;              // vertices, at most
    bool keyword = false;            // they begin with "v", and lines that do not are passed over
    std::optional<size_t> color_at;  // number of the word that is red, the keyword not counted
};

using VertexWords = std::array<std::string_view, max_vertex_words>;

// The words of a vertex without its keyword; nothing if the line is something else.
std::optional<std::span<const std::string_view>> vertex_words(std::string_view line, bool keyword, VertexWords& words) {
    const size_t count = std::min(split_numbers(without_comment(line), words), words.size());
    if (count == 0 || (keyword && words[0] != "v")) return std::nullopt;
    return std::span<const std::string_view>(words).subspan(keyword ? 1 : 0, count - (keyword ? 1 : 0));
}

class VertexReader final : public PointReader {
public:
    explicit VertexReader(const VertexLines& lines) : lines_(lines) {}
    uint64_t count() const override { return lines_.count; }
    PointFields fields() const override { return {.color = lines_.color_at.has_value(), .color_type = ColorType::number}; }

    Status read(const InputFile& file, const Take& take) const override {
        LineReader lines(file, lines_.offset, lines_.line);
        std::vector<FilePoint> points;
        VertexWords words;
        for (uint64_t n = 0; n < lines_.count;) {
            std::string_view line;
            bool end = false;
            RAYPAGER_TRY(lines.next(line, end));
            if (end && lines_.keyword) break;
            if (end) return Status::failed(fmt::format("{}: ends after {} of {} vertices; it is truncated", file.path().string(), n, lines_.count));
            const auto vertex = vertex_words(line, lines_.keyword, words);
            if (!vertex) continue;
            if (const auto bad = parse(*vertex, points.emplace_back()))
                return lines.bad(*bad < vertex->size() ? fmt::format("\"{}\" is no number", clipped((*vertex)[*bad]))
                                                       : "a vertex needs three numbers");
            ++n;
            if (points.size() < points_at_once) continue;
            RAYPAGER_TRY(take(points));
            points.clear();
        }
        return points.empty() ? Status() : take(points);
    }

    void sample(const InputFile& file, uint64_t part, uint64_t parts, size_t most, std::vector<FilePoint>& points) const override {
        const uint64_t bytes = file.size() - lines_.offset, begin = lines_.offset + bytes * part / parts,
                       end = lines_.offset + bytes * (part + 1) / parts;
        // A line belongs to the part that it begins in.
        const bool within = begin > lines_.offset;
        LineReader lines(file, begin - (within ? 1 : 0));
        VertexWords words;
        const size_t goal = points.size() + most;
        for (bool first = within; points.size() < goal && (first || lines.position() < end); first = false) {
            std::string_view line;
            bool no_more = false;
            if (!lines.next(line, no_more).ok() || no_more) return;
            if (first) continue;
            const auto vertex = vertex_words(line, lines_.keyword, words);
            if (vertex && parse(*vertex, points.emplace_back())) points.pop_back();
        }
    }

private:
    // The number of the first word that is missing or no number where one is needed; nothing if point was filled.
    std::optional<size_t> parse(std::span<const std::string_view> words, FilePoint& point) const {
        const auto number = [&](size_t i, auto& value) {
            const auto parsed = i < words.size() ? parse_number(words[i]) : std::nullopt;
            if (parsed) value = static_cast<std::remove_reference_t<decltype(value)>>(*parsed);
            return parsed.has_value();
        };
        for (size_t a = 0; a < 3; ++a)
            if (!number(a, point.position[a])) return a;
        for (size_t c = 0; lines_.color_at && c < 3; ++c)
            if (!number(*lines_.color_at + c, point.color[c])) return *lines_.color_at + c;
        return std::nullopt;
    }

    VertexLines lines_;
};

// Whether the first vertices have three numbers from `at` on.
bool have_colors(const InputFile& file, const VertexLines& where, size_t at) {
    constexpr int looked_at = 100;
    LineReader lines(file, where.offset, where.line);
    VertexWords words;
    int seen = 0;
    while (seen < looked_at) {
        std::string_view line;
        bool end = false;
        if (!lines.next(line, end).ok() || end) break;
        const auto vertex = vertex_words(line, where.keyword, words);
        if (!vertex) continue;
        if (vertex->size() < at + 3) return false;
        ++seen;
    }
    return seen > 0;
}

std::optional<uint64_t> whole_number(std::string_view word) {
    const auto value = parse_number(word);
    if (!value || !(*value >= 0 && *value < 1e15) || *value != static_cast<double>(static_cast<uint64_t>(*value))) return std::nullopt;
    return static_cast<uint64_t>(*value);
}

// The header of an OFF file that declares vertices and no faces; nothing if it is anything else.
std::optional<VertexLines> point_off_header(const InputFile& file) {
    constexpr int longest_header = 1000;  // lines, comments included
    LineReader lines(file);
    std::vector<std::string> words;
    for (int i = 0; i < longest_header && words.size() < 3; ++i) {
        std::string_view line;
        bool end = false;
        if (!lines.next(line, end).ok() || end) return std::nullopt;
        for (const std::string_view word : split_words(without_comment(line))) {
            const size_t off = words.empty() ? word.find("OFF") : std::string_view::npos;
            if (off == std::string_view::npos) {
                words.emplace_back(word);
            } else {  // the first count may follow without a blank
                words.emplace_back(word.substr(0, off + 3));
                if (word.size() > off + 3) words.emplace_back(word.substr(off + 3));
            }
        }
    }
    if (words.size() < 3 || words.size() > 4 || !words[0].ends_with("OFF")) return std::nullopt;
    const std::string prefix = words[0].substr(0, words[0].size() - 3);
    const auto vertices = whole_number(words[1]), faces = whole_number(words[2]);
    if (prefix.find_first_not_of("CN") != std::string::npos || !vertices || !faces || *vertices == 0 || *faces != 0) return std::nullopt;
    VertexLines where{lines.position(), lines.line() + 1, std::min<uint64_t>(*vertices, file.size()), false, std::nullopt};
    // The number of edges may be on a line of its own.
    std::string_view next;
    bool end = false;
    if (words.size() == 3 && lines.next(next, end).ok() && !end && split_words(without_comment(next)).size() == 1) {
        where.offset = lines.position();
        where.line = lines.line() + 1;
    }
    const size_t at = prefix.find('N') == std::string::npos ? 3 : 6;
    if (have_colors(file, where, at)) where.color_at = at;
    return where;
}

// Calls look(first two characters) for the start of each line until it returns false.
template <class Look>
void for_each_line_start(const InputFile& file, const Look& look) {
    std::vector<std::byte> buffer;
    char before = '\n', first = 0;
    for (uint64_t at = 0; at < file.size(); at += buffer.size()) {
        buffer.resize(std::min<uint64_t>(scanned_at_once, file.size() - at));
        if (!file.read(at, buffer).ok()) return;
        for (const std::byte byte : buffer) {
            const char c = static_cast<char>(byte);
            if (first != 0) {
                if (!look(first, c)) return;
                first = 0;
            } else if ((before == '\n' || before == '\r') && c != '\n' && c != '\r') {
                if (is_blank(c)) continue;  // it may begin behind blanks
                first = c;
            }
            before = c;
        }
    }
}

}  // namespace

bool is_point_off(const InputFile& file) { return point_off_header(file).has_value(); }

bool is_point_obj(const InputFile& file) {
    bool vertices = false, others = false;
    for_each_line_start(file, [&](char first, char second) {
        vertices |= first == 'v' && is_blank(second);
        // Faces, lines, curves; "s" and "c" alone are smoothing groups and unknown.
        others |= (first == 'f' && (is_blank(second) || second == 'o')) || (first == 'l' && is_blank(second)) || (first == 'c' && second == 'u') ||
                  (first == 's' && second == 'u');
        return !others;
    });
    return vertices && !others;
}

Result<std::unique_ptr<PointReader>> open_off_points(const InputFile& file) {
    const auto where = point_off_header(file);
    if (!where) return Status::failed(file.path().string() + ": is no OFF file of points");
    return std::unique_ptr<PointReader>(std::make_unique<VertexReader>(*where));
}

Result<std::unique_ptr<PointReader>> open_obj_points(const InputFile& file) {
    VertexLines where;
    where.keyword = true;
    where.count = file.size() / 7 + 1;  // "v 0 0 0" at least
    if (have_colors(file, where, 3)) where.color_at = 3;
    return std::unique_ptr<PointReader>(std::make_unique<VertexReader>(where));
}

}  // namespace raypager
