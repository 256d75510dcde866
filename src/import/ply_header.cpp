#include "import/ply_header.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>

#include "import/text.hpp"

namespace raypager {
namespace {

constexpr uint64_t largest_header = uint64_t{1} << 20;
// Vertex indices are 32 bits wide, and the last one is kept for "none".
constexpr uint64_t largest_count = 0xfffffffe;

struct TypeName {
    std::string_view name;
    PlyType type;
};
constexpr TypeName type_names[] = {
    {"char", PlyType::int8},     {"int8", PlyType::int8},       {"uchar", PlyType::uint8},    {"uint8", PlyType::uint8},
    {"short", PlyType::int16},   {"int16", PlyType::int16},     {"ushort", PlyType::uint16},  {"uint16", PlyType::uint16},
    {"int", PlyType::int32},     {"int32", PlyType::int32},     {"uint", PlyType::uint32},    {"uint32", PlyType::uint32},
    {"float", PlyType::float32}, {"float32", PlyType::float32}, {"double", PlyType::float64}, {"float64", PlyType::float64},
};

std::optional<PlyType> parse_type(std::string_view name) {
    for (const TypeName& t : type_names)
        if (t.name == name) return t.type;
    return std::nullopt;
}

// Parses the header's lines one by one.
class HeaderParser {
public:
    explicit HeaderParser(std::string name) : name_(std::move(name)) {}

    Status line(std::string_view text) {
        ++header.lines;
        const auto words = split_words(text);
        if (header.lines == 1) return words.size() == 1 && words[0] == "ply" ? Status() : bad("does not start with \"ply\": not a PLY file");
        if (words.empty() || words[0] == "comment" || words[0] == "obj_info") return {};
        if (words[0] == "format") return format(words);
        if (words[0] == "element") return element(words);
        if (words[0] == "property") return property(words);
        if (words[0] != "end_header" || words.size() != 1) {
            // A comment whose keyword a writer forgot. Were it a damaged element or property, the data would no longer fit.
            if (header.warnings.empty())
                header.warnings.push_back(
                    fmt::format("{}:{}: \"{}\" is no line of a PLY header; it is passed over", name_, header.lines, clipped(text)));
            return {};
        }
        if (!has_format_) return bad("the header has no format line");
        ended = true;
        return {};
    }

    PlyHeader header;
    bool ended = false;

private:
    Status bad(const std::string& what) const { return Status::failed(fmt::format("{}:{}: {}", name_, header.lines, what)); }

    Status format(const std::vector<std::string_view>& words) {
        if (words.size() != 3 || words[2] != "1.0") return bad("expected \"format ENCODING 1.0\"");
        if (words[1] == "ascii")
            header.encoding = PlyEncoding::ascii;
        else if (words[1] == "binary_little_endian")
            header.encoding = PlyEncoding::little_endian;
        else if (words[1] == "binary_big_endian")
            header.encoding = PlyEncoding::big_endian;
        else
            return bad(fmt::format("unknown encoding \"{}\"", clipped(words[1])));
        has_format_ = true;
        return {};
    }

    Status element(const std::vector<std::string_view>& words) {
        if (words.size() != 3) return bad("expected \"element NAME COUNT\"");
        PlyElement element;
        element.name = words[1];
        const auto [end, error] = std::from_chars(words[2].data(), words[2].data() + words[2].size(), element.count);
        if (error != std::errc() || end != words[2].data() + words[2].size()) return bad(fmt::format("\"{}\" is no count", clipped(words[2])));
        if (element.count > largest_count) return bad(fmt::format("{} elements are more than the {} that can be read", element.count, largest_count));
        header.elements.push_back(std::move(element));
        return {};
    }

    Status property(const std::vector<std::string_view>& words) {
        if (header.elements.empty()) return bad("a property before any element");
        PlyProperty property;
        const bool list = words.size() == 5 && words[1] == "list";
        if (!list && words.size() != 3) return bad("expected \"property TYPE NAME\" or \"property list TYPE TYPE NAME\"");
        const auto type = parse_type(words[list ? 3 : 1]);
        const auto count_type = list ? parse_type(words[2]) : std::nullopt;
        if (!type || (list && !count_type)) return bad("unknown property type");
        if (list && !ply_type_is_integer(*count_type)) return bad("the length of a list must be an integer");
        property.type = *type;
        property.count_type = count_type;
        property.name = words.back();
        header.elements.back().properties.push_back(std::move(property));
        return {};
    }

    std::string name_;
    bool has_format_ = false;
};

// The least number of bytes that one item of element takes.
uint64_t smallest_item(const PlyElement& element, PlyEncoding encoding) {
    uint64_t bytes = 0;
    for (const PlyProperty& p : element.properties) bytes += encoding == PlyEncoding::ascii ? 2 : ply_type_bytes(p.count_type.value_or(p.type));
    return bytes;
}

Status check_counts(const PlyHeader& header, const InputFile& file) {
    uint64_t available = file.size() - header.bytes;
    if (header.encoding == PlyEncoding::ascii) ++available;  // the last line need not end in a newline
    for (const PlyElement& element : header.elements) {
        const uint64_t bytes = smallest_item(element, header.encoding);
        if (element.count == 0) continue;
        if (bytes == 0) return Status::failed(fmt::format("{}: element \"{}\" has no properties", file.path().string(), clipped(element.name)));
        if (element.count > available / bytes)
            return Status::failed(
                fmt::format("{}: the header promises {} items of \"{}\", but the file has only {} bytes; it is truncated or damaged",
                            file.path().string(), element.count, clipped(element.name), file.size()));
        available -= element.count * bytes;
    }
    return {};
}

}  // namespace

size_t ply_type_bytes(PlyType type) {
    switch (type) {
        case PlyType::int8:
        case PlyType::uint8:
            return 1;
        case PlyType::int16:
        case PlyType::uint16:
            return 2;
        case PlyType::float64:
            return 8;
        default:
            return 4;
    }
}

bool ply_type_is_integer(PlyType type) { return type != PlyType::float32 && type != PlyType::float64; }

bool PlyElement::has_list() const {
    return std::any_of(properties.begin(), properties.end(), [](const PlyProperty& p) { return p.count_type.has_value(); });
}

std::optional<size_t> PlyElement::find(std::string_view property) const {
    for (size_t i = 0; i < properties.size(); ++i)
        if (properties[i].name == property) return i;
    // Some writers care little about capitals: Red, X.
    const auto same = [](char a, char b) { return a == b || (a >= 'A' && a <= 'Z' && a + 32 == b); };
    for (size_t i = 0; i < properties.size(); ++i)
        if (std::equal(properties[i].name.begin(), properties[i].name.end(), property.begin(), property.end(), same)) return i;
    return std::nullopt;
}

const PlyElement* PlyHeader::find(std::string_view element) const {
    for (const PlyElement& e : elements)
        if (e.name == element) return &e;
    return nullptr;
}

bool PlyLayout::in_pieces() const {
    return !vertices->has_list() && (!faces || vertices < faces) && (!strips || vertices < strips) && !face_color && !wedge_colors && !wedge_uvs;
}

Result<PlyHeader> read_ply_header(const InputFile& file) {
    std::string text(std::min(file.size(), largest_header), '\0');
    RAYPAGER_TRY(file.read(0, std::as_writable_bytes(std::span(text))));
    HeaderParser parser(file.path().string());
    size_t at = text.starts_with("\xef\xbb\xbf") ? 3 : 0;
    // The first line says how lines end: binary data that look like another line end may follow the last one.
    const size_t first_end = text.find_first_of("\r\n", at);
    const bool carriage_returns =
        first_end != std::string::npos && text[first_end] == '\r' && text.substr(first_end + 1, 1) != "\n" && text.substr(first_end + 1, 2) != "\r\n";
    while (!parser.ended) {
        const size_t end = text.find(carriage_returns ? '\r' : '\n', at);
        const bool last = end == std::string::npos;
        // A first line without end may be a megabyte of anything: look at its start only.
        if (!last || parser.header.lines == 0)
            RAYPAGER_TRY(parser.line(trim_line_end(trim_line_end(std::string_view(text).substr(at, last ? 256 : end - at)))));
        if (last) return Status::failed(file.path().string() + ": ends within its PLY header; it is truncated or no PLY file");
        at = end + 1;
    }
    parser.header.bytes = at;
    RAYPAGER_TRY(check_counts(parser.header, file));
    return std::move(parser.header);
}

namespace {

template <size_t n>
std::optional<std::array<size_t, n>> find_all(const PlyElement& element, const std::array<const char*, n>& names) {
    std::array<size_t, n> found = {};
    for (size_t i = 0; i < n; ++i) {
        const auto property = element.find(names[i]);
        if (!property || element.properties[*property].count_type) return std::nullopt;
        found[i] = *property;
    }
    return found;
}

PlyLayout::Triple find_color(const PlyElement& element) {
    auto color = find_all<3>(element, {"red", "green", "blue"});
    if (!color) color = find_all<3>(element, {"diffuse_red", "diffuse_green", "diffuse_blue"});
    return color ? color : find_all<3>(element, {"r", "g", "b"});
}

std::optional<std::array<size_t, 2>> find_uv(const PlyElement& element) {
    constexpr std::array<const char*, 2> names[] = {
        {"u", "v"}, {"s", "t"}, {"texture_u", "texture_v"}, {"texture_s", "texture_t"}, {"texcoord_u", "texcoord_v"}, {"texcoord_s", "texcoord_t"}};
    for (const auto& pair : names)
        if (const auto found = find_all<2>(element, pair)) return found;
    return std::nullopt;
}

std::optional<size_t> find_indices(const PlyElement& element) {
    auto indices = element.find("vertex_indices");
    if (!indices) indices = element.find("vertex_index");
    if (!indices || !element.properties[*indices].count_type || !ply_type_is_integer(element.properties[*indices].type)) return std::nullopt;
    return indices;
}

const PlyElement* if_any(const PlyElement* element) { return element && element->count > 0 ? element : nullptr; }

}  // namespace

Result<PlyLayout> find_ply_layout(const PlyHeader& header, const std::string& name, bool uvs) {
    PlyLayout layout;
    layout.vertices = if_any(header.find("vertex"));
    layout.faces = if_any(header.find("face"));
    layout.strips = if_any(header.find("tristrips"));
    if (!layout.vertices) return Status::failed(name + ": has no vertices");
    if (!layout.faces && !layout.strips)
        return Status::failed(name + ": has no faces: it is no mesh; in a .pbrt scene, Shape \"points\" takes point clouds");
    const auto position = find_all<3>(*layout.vertices, {"x", "y", "z"});
    if (!position) return Status::failed(name + ": its vertices lack x, y or z");
    std::copy(position->begin(), position->end(), layout.position);
    layout.normal = find_all<3>(*layout.vertices, {"nx", "ny", "nz"});
    layout.vertex_color = find_color(*layout.vertices);
    if (uvs) layout.uv = find_uv(*layout.vertices);
    if (layout.faces) {
        const auto indices = find_indices(*layout.faces);
        if (!indices) return Status::failed(name + ": its faces lack a list of whole numbers named vertex_indices");
        layout.indices = *indices;
        layout.face_color = find_color(*layout.faces);
        const auto wedges = layout.faces->find("color");
        if (wedges && layout.faces->properties[*wedges].count_type) layout.wedge_colors = wedges;
        const auto uvs_of_corners = layout.faces->find("texcoord");
        if (uvs && !layout.uv && uvs_of_corners && layout.faces->properties[*uvs_of_corners].count_type) layout.wedge_uvs = uvs_of_corners;
        layout.face_number = layout.faces->find("face_indices");
        if (layout.face_number && layout.faces->properties[*layout.face_number].count_type) layout.face_number.reset();
    }
    if (layout.strips) {
        const auto indices = find_indices(*layout.strips);
        if (!indices) return Status::failed(name + ": its triangle strips lack a list of whole numbers named vertex_indices");
        layout.strip_indices = *indices;
    }
    return layout;
}

}  // namespace raypager
