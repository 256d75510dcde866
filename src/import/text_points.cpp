// Points as lines of numbers. There is no standard; what is read is what the usual programs write:
//     # comment            also // and ; and %
//     X Y Z R G B          a line of words before the first point: names of the columns, also as a comment
//     1234                 PTS: how many points follow; may come again for each scan
//     x y z [intensity] [r g b]   numbers, separated by blanks, commas or semicolons; further columns are passed over
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>

#include "import/line_reader.hpp"
#include "import/point_readers.hpp"
#include "import/text.hpp"
#include "import/text_layout.hpp"

namespace raypager {
namespace {

constexpr size_t counted_at_once = size_t{1} << 20;

class TextReader final : public PointReader {
public:
    TextReader(uint64_t lines, TextLayout layout) : lines_(lines), layout_(std::move(layout)) {}
    uint64_t count() const override { return lines_; }
    PointFields fields() const override {
        return {.color = layout_.color.has_value(),
                .intensity = layout_.intensity.has_value(),
                .classification = layout_.classification.has_value(),
                .color_type = layout_.color_type,
                .z_up = true,
                .geographic = layout_.geographic};
    }
    std::vector<std::string> warnings() const override { return layout_.warnings; }

    Status read(const InputFile& file, const Take& take) const override;
    void sample(const InputFile& file, uint64_t part, uint64_t parts, size_t most, std::vector<FilePoint>& points) const override;

private:
    using Words = std::array<std::string_view, max_columns>;
    // Fills point from words that fit. The column of the first word that is no number where one is needed; nothing if there is none.
    std::optional<size_t> parse(std::span<const std::string_view> words, FilePoint& point) const;

    uint64_t lines_;
    TextLayout layout_;
};

std::optional<size_t> TextReader::parse(std::span<const std::string_view> words, FilePoint& point) const {
    const auto number = [&](size_t column, auto& value) {
        auto parsed = parse_number(words[column]);
        if (!parsed) parsed = parse_field(words[column], layout_.dialect);
        if (parsed) value = static_cast<std::remove_reference_t<decltype(value)>>(*parsed);
        return parsed.has_value();
    };
    for (size_t a = 0; a < 3; ++a)
        if (!number(layout_.position[a], point.position[a])) return layout_.position[a];
    if (layout_.intensity && !number(*layout_.intensity, point.intensity)) return *layout_.intensity;
    if (layout_.radius && !number(*layout_.radius, point.radius)) return *layout_.radius;
    if (layout_.classification) {
        double value = 0;
        if (!number(*layout_.classification, value)) return *layout_.classification;
        point.classification = value >= 0 && value <= 255 ? static_cast<uint8_t>(value) : uint8_t{0};
    }
    for (size_t c = 0; layout_.color && c < 3; ++c)
        if (!number((*layout_.color)[c], point.color[c])) return (*layout_.color)[c];
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
    Words words;
    while (true) {
        std::string_view line;
        bool end = false;
        RAYPAGER_TRY(lines.next(line, end));
        if (end) break;
        if (is_point_comment(line) || lines.line() == layout_.header_line) continue;
        const size_t count = split_fields(line, layout_.dialect, words);
        if (count == 1) {
            RAYPAGER_TRY(promise.begin(lines, words[0]));
            continue;
        }
        if (!layout_.fits(count)) return lines.bad(fmt::format("{} numbers, where the first point has {}", count, layout_.count));
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
    Words words;
    const size_t goal = points.size() + most;
    for (bool first = begin > 0; points.size() < goal && (first || lines.position() < end); first = false) {
        std::string_view line;
        bool no_more = false;
        if (!lines.next(line, no_more).ok() || no_more) return;
        if (first || is_point_comment(line) || !layout_.fits(split_fields(line, layout_.dialect, words))) continue;
        if (parse(words, points.emplace_back())) points.pop_back();
    }
}

// Of lines, those that end in a carriage return alone included. One too many is counted where the two characters of an end are torn apart.
uint64_t count_ends(std::string_view text) {
    auto ends = static_cast<uint64_t>(std::count(text.begin(), text.end(), '\n'));
    for (size_t at = text.find('\r'); at != std::string_view::npos; at = text.find('\r', at + 1)) ends += !text.substr(at + 1).starts_with('\n');
    return ends;
}

Result<uint64_t> count_lines(const InputFile& file) {
    std::vector<std::byte> buffer(std::min<uint64_t>(counted_at_once, file.size()));
    uint64_t lines = 1;  // the last one may lack its end
    for (uint64_t at = 0; at < file.size(); at += buffer.size()) {
        const auto bytes = std::span(buffer).first(std::min<uint64_t>(buffer.size(), file.size() - at));
        RAYPAGER_TRY(file.read(at, bytes));
        lines += count_ends(std::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
    }
    return lines;
}

}  // namespace

Result<std::unique_ptr<PointReader>> open_text_points(const InputFile& file, const PointColumns& columns) {
    auto layout = find_text_layout(file, columns);
    if (!layout) return layout.status();
    const auto lines = count_lines(file);
    if (!lines) return lines.status();
    return std::unique_ptr<PointReader>(std::make_unique<TextReader>(*lines, std::move(*layout)));
}

}  // namespace raypager
