#include "import/mesh_look.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>

#include "import/line_reader.hpp"
#include "import/mesh_colors.hpp"
#include "import/origin.hpp"
#include "import/ply_mesh.hpp"
#include "import/stl_layout.hpp"
#include "import/text.hpp"

namespace raypager {
namespace {

// So many places of a file are looked at, and so many vertices at each.
constexpr uint64_t places = 16, vertices_at_a_place = 256;

// In extents from the origin: of the seven digits of single precision, two are left from here on.
constexpr double lost_from = 1e5;

struct Sample {
    std::vector<FilePosition> positions;
    double largest_color = 0;
};

// Lines from several places of the file on. What is damaged is left out: the reader will meet it.
void sample_lines(const InputFile& file, const std::function<void(std::string_view)>& take) {
    constexpr uint64_t bytes_at_a_place = 16 << 10;
    const uint64_t parts = file.size() <= places * bytes_at_a_place ? 1 : places;
    for (uint64_t part = 0; part < parts; ++part) {
        const uint64_t begin = file.size() / parts * part, end = parts == 1 ? file.size() : begin + bytes_at_a_place;
        LineReader lines(file, begin);
        std::string_view line;
        bool none = false;
        if (part > 0 && (!lines.next(line, none).ok() || none)) continue;  // the rest of a line
        while (lines.position() < end && lines.next(line, none).ok() && !none) take(line);
    }
}

std::optional<FilePosition> parse_position(std::span<const std::string_view> words) {
    FilePosition p = {};
    if (words.size() < 3) return std::nullopt;
    for (size_t a = 0; a < 3; ++a) {
        const auto value = parse_number(words[a]);
        if (!value) return std::nullopt;
        p[a] = *value;
    }
    return p;
}

// Positions behind this word: "v" in OBJ, "vertex" in STL.
void sample_after_keyword(const InputFile& file, std::string_view keyword, Sample& sample) {
    std::vector<std::string_view> words;
    sample_lines(file, [&](std::string_view line) {
        split_words(line, words);
        for (size_t i = 0; i + 3 < words.size(); ++i) {
            const bool same = words[i].size() == keyword.size() &&
                              std::equal(words[i].begin(), words[i].end(), keyword.begin(), [](char a, char b) { return (a | 0x20) == b; });
            if (!same) continue;
            if (const auto p = parse_position(std::span(words).subspan(i + 1))) sample.positions.push_back(*p);
        }
    });
}

// The first vertices of an OFF file, a line each, behind the counts.
void sample_off(const InputFile& file, Sample& sample) {
    LineReader lines(file);
    std::vector<std::string_view> words;
    std::string_view line;
    bool end = false;
    std::optional<double> left;  // vertices
    while (left.value_or(1) > 0 && sample.positions.size() < places * vertices_at_a_place && lines.next(line, end).ok() && !end) {
        split_words(without_comment(line), words);
        if (!left && !words.empty() && words[0].find("OFF") != std::string_view::npos) {
            words[0].remove_prefix(words[0].find("OFF") + 3);
            if (words[0].empty()) words.erase(words.begin());
        }
        if (words.empty()) continue;
        if (!left) {
            left = parse_number(words[0]).value_or(0);
            continue;
        }
        if (const auto p = parse_position(words)) sample.positions.push_back(*p);
        *left -= 1;
    }
}

void add_vertex(const PlyLayout& layout, const std::function<std::optional<double>(size_t)>& value, Sample& sample) {
    FilePosition p = {};
    for (size_t a = 0; a < 3; ++a) p[a] = value(layout.position[a]).value_or(NAN);
    sample.positions.push_back(p);
    if (!layout.vertex_color) return;
    for (const size_t property : *layout.vertex_color) {
        const double c = value(property).value_or(0);
        if (std::isfinite(c)) sample.largest_color = std::max(sample.largest_color, c);
    }
}

void sample_ply_text(const InputFile& file, const PlyHeader& header, const PlyLayout& layout, Sample& sample) {
    uint64_t before = 0;  // items, a line each
    for (const PlyElement& element : header.elements) {
        if (&element == layout.vertices) break;
        before += element.count;
    }
    LineReader lines(file, header.bytes, header.lines + 1);
    std::vector<std::string_view> words;
    std::string_view line;
    bool end = false;
    while (sample.positions.size() < std::min(places * vertices_at_a_place, layout.vertices->count) && lines.next(line, end).ok() && !end) {
        if (before > 0) {
            --before;
            continue;
        }
        split_words(line, words);
        if (words.size() != layout.vertices->properties.size()) return;
        add_vertex(
            layout, [&](size_t p) { return parse_number(words[p]); }, sample);
    }
}

// Only of files whose vertices are at a known place.
void sample_ply_binary(const InputFile& file, const PlyHeader& header, const PlyLayout& layout, Sample& sample) {
    uint64_t at = header.bytes;
    for (const PlyElement& element : header.elements) {
        if (&element == layout.vertices) break;
        if (element.has_list() && element.count > 0) return;
        for (const PlyProperty& p : element.properties) at += element.count * ply_type_bytes(p.type);
    }
    if (layout.vertices->has_list()) return;
    std::vector<size_t> offsets;
    size_t stride = 0;
    for (const PlyProperty& p : layout.vertices->properties) {
        offsets.push_back(stride);
        stride += ply_type_bytes(p.type);
    }
    const uint64_t count = layout.vertices->count, parts = count <= places * vertices_at_a_place ? 1 : places;
    for (uint64_t part = 0; part < parts; ++part) {
        const uint64_t first = count / parts * part, some = parts == 1 ? count : vertices_at_a_place;
        std::vector<std::byte> bytes(static_cast<size_t>(some * stride));
        if (!file.read(at + first * stride, bytes).ok()) return;
        for (uint64_t i = 0; i < some; ++i)
            add_vertex(
                layout,
                [&](size_t p) -> std::optional<double> {
                    return load_ply_number(bytes.data() + i * stride + offsets[p], layout.vertices->properties[p].type,
                                           header.encoding == PlyEncoding::big_endian);
                },
                sample);
    }
}

void sample_stl_binary(const InputFile& file, uint64_t triangles, Sample& sample) {
    const uint64_t parts = triangles <= places * vertices_at_a_place ? 1 : places;
    for (uint64_t part = 0; part < parts; ++part) {
        const uint64_t first = triangles / parts * part, some = parts == 1 ? triangles : vertices_at_a_place;
        std::vector<std::byte> bytes(static_cast<size_t>(some * stl_triangle_bytes));
        if (!file.read(stl_header_bytes + first * stl_triangle_bytes, bytes).ok()) return;
        for (uint64_t i = 0; i < some; ++i) {
            std::array<float, 3> p;
            std::memcpy(p.data(), bytes.data() + i * stl_triangle_bytes + 12, sizeof p);
            sample.positions.push_back({p[0], p[1], p[2]});
        }
    }
}

Status look_at_ply(const InputFile& file, Sample& sample, MeshLook& look, bool& single_precision) {
    const auto header = read_ply_header(file);
    if (!header) return header.status();
    const auto layout = find_ply_layout(*header, file.path().string(), false);
    if (!layout) return layout.status();
    if (header->encoding == PlyEncoding::ascii) {
        sample_ply_text(file, *header, *layout, sample);
    } else {
        if (layout->faces) look.declared_triangles = layout->faces->count;
        look.in_pieces = layout->in_pieces();
        sample_ply_binary(file, *header, *layout, sample);
        single_precision = layout->vertices->properties[layout->position[0]].type == PlyType::float32;
    }
    look.has_colors = layout->vertex_color || layout->face_color || layout->wedge_colors;
    if (!layout->vertex_color) return {};
    const PlyType type = layout->vertices->properties[(*layout->vertex_color)[0]].type;
    // Those who write more than a byte do not always mean its whole range.
    look.view.color_scale = ply_color_scale(type, sample.largest_color);
    return {};
}

std::vector<FilePosition> bounds_of(const std::vector<FilePosition>& positions, const FilePosition& origin) {
    std::vector<FilePosition> corners;
    for (const FilePosition& p : positions) {
        if (!is_usable(p)) continue;
        const FilePosition q = {p[0] - origin[0], p[1] - origin[1], p[2] - origin[2]};
        if (corners.empty()) corners = {q, q};
        for (size_t a = 0; a < 3; ++a) {
            corners[0][a] = std::min(corners[0][a], q[a]);
            corners[1][a] = std::max(corners[1][a], q[a]);
        }
    }
    return corners;
}

}  // namespace

Result<MeshLook> look_at_mesh_file(const InputFile& file, MeshFormat format) {
    const std::string name = file.path().string();
    if (file.size() == 0) return Status::failed(name + ": is empty");
    MeshLook look;
    Sample sample;
    bool single_precision = false;
    switch (format) {
        case MeshFormat::ply:
            if (auto status = look_at_ply(file, sample, look, single_precision); !status.ok()) return status;
            break;
        case MeshFormat::obj:
            sample_after_keyword(file, "v", sample);
            break;
        case MeshFormat::off:
            sample_off(file, sample);
            break;
        case MeshFormat::stl: {
            const auto layout = find_stl_layout(file);
            if (!layout) return layout.status();
            single_precision = layout->binary;
            if (layout->binary)
                sample_stl_binary(file, layout->triangles, sample);
            else
                sample_after_keyword(file, "vertex", sample);
            break;
        }
    }
    look.view.origin = choose_origin(sample.positions);
    look.corners_of_sample = bounds_of(sample.positions, look.view.origin);
    look.lost_digits = single_precision && remoteness(sample.positions) > lost_from;
    return look;
}

}  // namespace raypager
