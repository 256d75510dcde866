#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "import/line_reader.hpp"
#include "import/point_readers.hpp"
#include "import/text.hpp"

namespace raypager {
namespace {

// Where a point is among the properties of a vertex.
struct PointLayout {
    PlyElement vertex;
    std::array<size_t, 3> position{};
    std::optional<std::array<size_t, 3>> color;
    std::optional<size_t> intensity, classification, radius;
    bool geographic = false;
    std::vector<std::string> warnings;

    PointFields fields() const {
        ColorType type = ColorType::number;
        if (color && vertex.properties[(*color)[0]].type == PlyType::uint8) type = ColorType::byte;
        if (color && vertex.properties[(*color)[0]].type == PlyType::uint16) type = ColorType::word;
        return {.color = color.has_value(),
                .intensity = intensity.has_value(),
                .classification = classification.has_value(),
                .color_type = type,
                .geographic = geographic};
    }
    // value(property): the vertex's value of it.
    template <class Value>
    FilePoint point(const Value& value) const {
        FilePoint point;
        for (size_t a = 0; a < 3; ++a) point.position[a] = value(position[a]);
        if (color)
            for (size_t c = 0; c < 3; ++c) point.color[c] = static_cast<float>(value((*color)[c]));
        if (intensity) point.intensity = static_cast<float>(value(*intensity));
        if (classification) {
            const double number = value(*classification);
            point.classification = number >= 0 && number <= 255 ? static_cast<uint8_t>(number) : uint8_t{0};
        }
        if (radius) point.radius = static_cast<float>(value(*radius));
        return point;
    }
};

// Where the properties of a vertex begin in its record, and behind the last one where it ends.
std::vector<size_t> property_offsets(const PlyElement& vertex) {
    std::vector<size_t> offsets = {0};
    for (const PlyProperty& p : vertex.properties) offsets.push_back(offsets.back() + ply_type_bytes(p.type));
    return offsets;
}

class BinaryPly final : public RecordReader {
public:
    // offset: of the first vertex.
    BinaryPly(PointLayout layout, uint64_t offset, bool swap)
        : RecordReader({offset, layout.vertex.count, property_offsets(layout.vertex).back()}),
          layout_(std::move(layout)),
          swap_(swap),
          offsets_(property_offsets(layout_.vertex)) {}
    PointFields fields() const override { return layout_.fields(); }
    std::vector<std::string> warnings() const override { return layout_.warnings; }

    void decode(const std::byte* record, size_t count, std::vector<FilePoint>& points) const override {
        const auto value = [&](size_t p) { return load_ply_number(record + offsets_[p], layout_.vertex.properties[p].type, swap_); };
        for (size_t i = 0; i < count; ++i, record += records().stride) points.push_back(layout_.point(value));
    }

private:
    PointLayout layout_;
    bool swap_;
    std::vector<size_t> offsets_;
};

// Vertices come first, one a line.
class TextPly final : public PointReader {
public:
    // alone: no other elements follow.
    TextPly(PointLayout layout, uint64_t offset, uint64_t header_lines, bool alone)
        : layout_(std::move(layout)), offset_(offset), header_lines_(header_lines), alone_(alone) {}
    uint64_t count() const override { return layout_.vertex.count; }
    PointFields fields() const override { return layout_.fields(); }
    std::vector<std::string> warnings() const override { return layout_.warnings; }

    Status read(const InputFile& file, const Take& take) const override {
        LineReader lines(file, offset_, header_lines_ + 1);
        std::vector<std::string_view> words;
        std::vector<FilePoint> points;
        for (uint64_t i = 0; i < layout_.vertex.count;) {
            std::string_view line;
            bool end = false;
            RAYPAGER_TRY(lines.next(line, end));
            if (end) return lines.bad(fmt::format("ends after {} of {} points; the file is truncated", i, layout_.vertex.count));
            split_words(line, words);
            if (words.empty()) continue;
            FilePoint point;
            if (!parse(words, point)) return lines.bad(no_point(words));
            points.push_back(point);
            if (++i % points_at_once != 0 && i < layout_.vertex.count) continue;
            RAYPAGER_TRY(take(points));
            points.clear();
        }
        return alone_ ? expect_end(lines) : Status();
    }

    void sample(const InputFile& file, uint64_t part, uint64_t parts, size_t most, std::vector<FilePoint>& points) const override {
        const uint64_t bytes = file.size() - offset_, begin = bytes * part / parts, end = bytes * (part + 1) / parts;
        LineReader lines(file, offset_ + begin - (begin > 0));  // as for other text: a line belongs to the part that it begins in
        std::vector<std::string_view> words;
        const size_t goal = points.size() + most;
        for (bool first = begin > 0; points.size() < goal && (first || lines.position() < offset_ + end); first = false) {
            std::string_view line;
            bool no_more = false;
            if (!lines.next(line, no_more).ok() || no_more) return;
            split_words(line, words);
            FilePoint point;
            if (!first && parse(words, point)) points.push_back(point);
        }
    }

private:
    bool parse(const std::vector<std::string_view>& words, FilePoint& point) const {
        if (words.size() != layout_.vertex.properties.size()) return false;
        bool sound = true;
        point = layout_.point([&](size_t p) {
            const auto number = parse_number(words[p]);
            sound = sound && number;
            return number.value_or(0);
        });
        return sound;
    }

    std::string no_point(const std::vector<std::string_view>& words) const {
        const auto word = std::find_if(words.begin(), words.end(), [](std::string_view w) { return !parse_number(w); });
        const std::string what = word == words.end() ? fmt::format("there are {}", words.size()) : fmt::format("\"{}\" is none", clipped(*word));
        return fmt::format("expected the {} numbers of a point; {}", layout_.vertex.properties.size(), what);
    }

    Status expect_end(LineReader& lines) const {
        std::string_view line;
        for (bool end = false; !end;) {
            RAYPAGER_TRY(lines.next(line, end));
            if (!split_words(line).empty()) return lines.bad("text after the last point; header and data do not match");
        }
        return {};
    }

    PointLayout layout_;
    uint64_t offset_, header_lines_;
    bool alone_;
};

Result<PointLayout> find_point_layout(const PlyHeader& header, const std::string& name) {
    PointLayout layout;
    layout.vertex = *header.find("vertex");
    if (layout.vertex.has_list()) return Status::failed(name + ": its points have lists among their properties, which cannot be read");
    // By PLY's own names, then by any that programs use for the same.
    const auto by_name = [&](PointColumn column) -> std::optional<size_t> {
        for (size_t i = 0; i < layout.vertex.properties.size(); ++i)
            if (find_point_column(layout.vertex.properties[i].name) == column) return i;
        return std::nullopt;
    };
    const auto triple = [&](const std::array<const char*, 3>& names, PointColumn first) -> std::optional<std::array<size_t, 3>> {
        std::array<std::optional<size_t>, 3> at;
        for (size_t a = 0; a < 3; ++a) at[a] = layout.vertex.find(names[a]);
        if (!at[0] || !at[1] || !at[2])
            for (size_t a = 0; a < 3; ++a) at[a] = by_name(static_cast<PointColumn>(static_cast<size_t>(first) + a));
        return at[0] && at[1] && at[2] ? std::optional(std::array{*at[0], *at[1], *at[2]}) : std::nullopt;
    };
    const auto position = triple({"x", "y", "z"}, PointColumn::x);
    if (!position) return Status::failed(name + ": its vertices lack x, y or z");
    layout.position = *position;
    layout.color = triple({"red", "green", "blue"}, PointColumn::red);
    layout.intensity = by_name(PointColumn::intensity);
    if (!layout.intensity) layout.classification = by_name(PointColumn::classification);
    layout.radius = layout.vertex.find("radius");
    layout.geographic = is_geographic_name(layout.vertex.properties[layout.position[0]].name);
    if (!layout.color && (by_name(PointColumn::red) || by_name(PointColumn::green) || by_name(PointColumn::blue)))
        layout.warnings.push_back(name + ": of red, green and blue its points have some alone, which are not used");
    return layout;
}

// Bytes of all elements up to and without `until` (null: of all); nothing if one has lists.
std::optional<uint64_t> fixed_bytes(const PlyHeader& header, const PlyElement* until) {
    uint64_t bytes = 0;
    for (const PlyElement& element : header.elements) {
        if (&element == until) break;
        if (element.count == 0) continue;
        if (element.has_list()) return std::nullopt;
        for (const PlyProperty& p : element.properties) bytes += element.count * ply_type_bytes(p.type);
    }
    return bytes;
}

// Other elements before the points take a line each.
Result<std::unique_ptr<PointReader>> open_text(const InputFile& file, const PlyHeader& header, PointLayout layout) {
    const bool alone =
        std::all_of(header.elements.begin(), header.elements.end(), [](const PlyElement& e) { return e.count == 0 || e.name == "vertex"; });
    uint64_t before = 0;
    for (const PlyElement* element = header.elements.data(); element != header.find("vertex"); ++element) before += element->count;
    LineReader lines(file, header.bytes, header.lines + 1);
    while (before > 0) {
        std::string_view line;
        bool end = false;
        RAYPAGER_TRY(lines.next(line, end));
        if (end) return lines.bad("ends before its points; the file is truncated");
        before -= !split_words(line).empty();
    }
    return std::unique_ptr<PointReader>(std::make_unique<TextPly>(std::move(layout), lines.position(), lines.line(), alone));
}

// What follows the last element of a binary file: a line end or padding does no harm.
Status check_rest(const InputFile& file, uint64_t end) {
    constexpr uint64_t max_padding = 16;
    const uint64_t rest = file.size() - end;
    std::vector<std::byte> bytes(std::min(rest, max_padding));
    RAYPAGER_TRY(file.read(end, bytes));
    const bool padding = std::all_of(bytes.begin(), bytes.end(), [](std::byte b) { return b == std::byte{0} || is_blank(static_cast<char>(b)); });
    if (padding && rest <= max_padding) return {};
    return Status::failed(fmt::format("{}: {} bytes follow the last element; header and data do not match", file.path().string(), rest));
}

}  // namespace

bool is_point_ply(const PlyHeader& header) {
    const PlyElement* const vertices = header.find("vertex");
    const auto has = [&](std::string_view name) { return header.find(name) && header.find(name)->count > 0; };
    return vertices && vertices->count > 0 && !has("face") && !has("tristrips");
}

Result<std::unique_ptr<PointReader>> open_ply_points(const InputFile& file, PlyHeader header) {
    const std::string name = file.path().string();
    if (!is_point_ply(header)) return Status::failed(name + ": has faces, or no vertices; it is no point cloud");
    auto layout = find_point_layout(header, name);
    if (!layout) return layout.status();
    layout->warnings.insert(layout->warnings.end(), header.warnings.begin(), header.warnings.end());
    if (header.encoding == PlyEncoding::ascii) return open_text(file, header, std::move(*layout));
    const auto before = fixed_bytes(header, header.find("vertex")), all = fixed_bytes(header, nullptr);
    if (!before) return Status::failed(name + ": elements with lists come before its points, which cannot be read; put them behind");
    if (all && file.size() - header.bytes > *all) RAYPAGER_TRY(check_rest(file, header.bytes + *all));
    return std::unique_ptr<PointReader>(
        std::make_unique<BinaryPly>(std::move(*layout), header.bytes + *before, header.encoding == PlyEncoding::big_endian));
}

}  // namespace raypager
