// Points as lines of numbers. There is no standard; what is read is what the usual programs write:
//     # comment            also // and ;
//     X Y Z R G B          a line of words before the first point
//     1234                 PTS: how many points follow; may come again for each scan
//     x y z [intensity] [r g b]   numbers, separated by blanks, commas or semicolons; further columns are passed over
// Which columns are colours is told from the first points: the first three neighbours from the fourth column on that are all whole numbers of 0
// to 255, or all within 0 and 1 (unless they are unit vectors: normals).
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>

#include "import/line_reader.hpp"
#include "import/point_readers.hpp"
#include "import/text.hpp"

namespace raypager {
namespace {

constexpr size_t most_columns = 16;  // that are looked at
constexpr size_t looked_at = 1000;   // points to tell columns from
constexpr size_t counted_at_once = size_t{1} << 20;

bool is_comment(std::string_view line) {
    const size_t start = line.find_first_not_of(" \t");
    if (start == std::string_view::npos) return true;
    line.remove_prefix(start);
    return line[0] == '#' || line[0] == ';' || line.starts_with("//");
}

// What three neighbouring columns of the first points look like.
class TripleStatistics {
public:
    void add(const double (&v)[3]) {
        for (const double x : v) {
            bytes_ = bytes_ && x >= 0 && x <= 255 && x == std::floor(x);
            fractions_ = fractions_ && x >= 0 && x <= 1;
        }
        const double length = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
        units_ = units_ && std::abs(length - 1) < 1e-2;
    }
    // White alone would pass for neither fractions nor normals, black alone for bytes.
    bool bytes() const { return bytes_; }
    bool fractions() const { return fractions_ && !units_; }

private:
    bool bytes_ = true, fractions_ = true, units_ = true;
};

struct Columns {
    size_t count = 0;  // words of each line
    std::optional<size_t> intensity, color;
    bool color_is_fraction = false;
    uint64_t header_line = 0;  // that is passed over, 0: none

    size_t known() const { return std::min(count, most_columns); }
    // triples[c]: of the columns from c on.
    void choose(const std::array<TripleStatistics, most_columns>& triples) {
        const auto try_color = [&](size_t c) {
            if (color || c + 2 >= known() || (!triples[c].bytes() && !triples[c].fractions())) return;
            color = c;
            color_is_fraction = !triples[c].bytes();
        };
        if (count == 7) try_color(4);  // an intensity of 0 to 255 comes before the colours, never after
        for (size_t c = 3; c < known(); ++c) try_color(c);
        if ((color && *color > 3) || (!color && (count == 4 || count == 5))) intensity = 3;
    }
};

class TextReader final : public PointReader {
public:
    TextReader(uint64_t lines, const Columns& columns) : lines_(lines), columns_(columns) {}
    uint64_t count() const override { return lines_; }
    PointFields fields() const override {
        return {.color = columns_.color.has_value(), .intensity = columns_.intensity.has_value(), .color_type = color_type(), .z_up = true};
    }

    Status read(const InputFile& file, const Take& take) const override;
    void sample(const InputFile& file, uint64_t part, uint64_t parts, size_t most, std::vector<FilePoint>& points) const override;

private:
    ColorType color_type() const { return columns_.color_is_fraction ? ColorType::number : ColorType::byte; }
    // The column of the first word that is no number where one is needed; nothing if point was filled.
    std::optional<size_t> parse(std::span<const std::string_view> words, FilePoint& point) const;

    uint64_t lines_;
    Columns columns_;
};

std::optional<size_t> TextReader::parse(std::span<const std::string_view> words, FilePoint& point) const {
    const auto number = [&](size_t column, auto& value) {
        const auto parsed = parse_number(words[column]);
        if (parsed) value = static_cast<std::remove_reference_t<decltype(value)>>(*parsed);
        return parsed.has_value();
    };
    for (size_t a = 0; a < 3; ++a)
        if (!number(a, point.position[a])) return a;
    if (columns_.intensity && !number(*columns_.intensity, point.intensity)) return *columns_.intensity;
    if (!columns_.color) return std::nullopt;
    for (size_t c = 0; c < 3; ++c)
        if (!number(*columns_.color + c, point.color[c])) return *columns_.color + c;
    return std::nullopt;
}

// Follows the lines that say how many points come.
class Promise {
public:
    // For a line of one word.
    Status begin(const LineReader& lines, std::string_view word) {
        RAYPAGER_TRY(end(lines));
        uint64_t count = 0;
        const auto [stop, error] = std::from_chars(word.data(), word.data() + word.size(), count);
        if (error != std::errc() || stop != word.data() + word.size())
            return lines.bad(fmt::format("\"{}\" is neither a point nor a number of points", clipped(word)));
        promised_ = count;
        line_ = lines.line();
        came_ = 0;
        return {};
    }
    void point() { ++came_; }
    Status end(const LineReader& lines) const {
        if (!promised_ || *promised_ == came_) return {};
        return lines.bad(fmt::format("line {} promises {} points, but {} came; the file is truncated or damaged", line_, *promised_, came_));
    }

private:
    std::optional<uint64_t> promised_;
    uint64_t came_ = 0, line_ = 0;
};

Status TextReader::read(const InputFile& file, const Take& take) const {
    LineReader lines(file);
    Promise promise;
    std::vector<FilePoint> points;
    std::array<std::string_view, most_columns> words;
    while (true) {
        std::string_view line;
        bool end = false;
        RAYPAGER_TRY(lines.next(line, end));
        if (end) break;
        if (is_comment(line) || lines.line() == columns_.header_line) continue;
        const size_t count = split_numbers(line, words);
        if (count == 1) {
            RAYPAGER_TRY(promise.begin(lines, words[0]));
            continue;
        }
        if (count != columns_.count) return lines.bad(fmt::format("{} numbers, where the first point has {}", count, columns_.count));
        if (const auto column = parse(words, points.emplace_back())) return lines.bad(fmt::format("\"{}\" is no number", clipped(words[*column])));
        promise.point();
        if (points.size() < points_at_once) continue;
        RAYPAGER_TRY(take(points));
        points.clear();
    }
    RAYPAGER_TRY(promise.end(lines));
    return points.empty() ? Status() : take(points);
}

void TextReader::sample(const InputFile& file, uint64_t part, uint64_t parts, size_t most, std::vector<FilePoint>& points) const {
    const uint64_t begin = file.size() * part / parts, end = file.size() * (part + 1) / parts;
    // A line belongs to the part that it begins in: what is left of the one before, perhaps its end alone, is passed over.
    LineReader lines(file, begin - (begin > 0));
    std::array<std::string_view, most_columns> words;
    const size_t goal = points.size() + most;
    for (bool first = begin > 0; points.size() < goal && (first || lines.position() < end); first = false) {
        std::string_view line;
        bool no_more = false;
        if (!lines.next(line, no_more).ok() || no_more) return;
        if (first || is_comment(line) || split_numbers(line, words) != columns_.count) continue;
        if (parse(words, points.emplace_back())) points.pop_back();
    }
}

// Tells the columns from the first points.
Result<Columns> find_columns(const InputFile& file) {
    LineReader lines(file);
    Columns columns;
    std::array<std::string_view, most_columns> words;
    std::array<TripleStatistics, most_columns> triples;
    for (size_t points = 0; points < looked_at;) {
        std::string_view line;
        bool end = false;
        RAYPAGER_TRY(lines.next(line, end));
        if (end) break;
        if (is_comment(line)) continue;
        const size_t count = split_numbers(line, words);
        if (columns.count == 0 && columns.header_line == 0 && !parse_number(words[0])) {
            columns.header_line = lines.line();
            continue;
        }
        if (count == 1) continue;
        if (columns.count == 0 && count < 3) return lines.bad("too few numbers; a point has three coordinates");
        if (columns.count == 0) columns.count = count;
        if (count != columns.count) break;  // read() will say where and why
        ++points;
        for (size_t c = 3; c + 2 < columns.known(); ++c) {
            double values[3];
            for (size_t i = 0; i < 3; ++i) values[i] = parse_number(words[c + i]).value_or(NAN);
            triples[c].add(values);
        }
    }
    if (columns.count == 0) return Status::failed(file.path().string() + ": has no points; lines of x y z are expected");
    columns.choose(triples);
    return columns;
}

Result<uint64_t> count_lines(const InputFile& file) {
    std::vector<std::byte> buffer(std::min<uint64_t>(counted_at_once, file.size()));
    uint64_t lines = 1;  // the last one may lack its end
    for (uint64_t at = 0; at < file.size(); at += buffer.size()) {
        const auto bytes = std::span(buffer).first(std::min<uint64_t>(buffer.size(), file.size() - at));
        RAYPAGER_TRY(file.read(at, bytes));
        lines += static_cast<uint64_t>(std::count(bytes.begin(), bytes.end(), std::byte{'\n'}));
    }
    return lines;
}

}  // namespace

Result<std::unique_ptr<PointReader>> open_text_points(const InputFile& file) {
    const auto columns = find_columns(file);
    if (!columns) return columns.status();
    const auto lines = count_lines(file);
    if (!lines) return lines.status();
    return std::unique_ptr<PointReader>(std::make_unique<TextReader>(*lines, *columns));
}

}  // namespace raypager
