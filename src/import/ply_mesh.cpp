#include "import/ply_mesh.hpp"

#include <bit>
#include <utility>

#include "image/ptex_atlas.hpp"

namespace raypager {

double ply_color_scale(PlyType type, double largest) {
    if (ply_type_bytes(type) == 1) return 255;
    return ply_type_is_integer(type) ? std::max(color_scale(largest), 255.0) : color_scale(largest);
}

void PlyMesh::add_vertex() {
    const auto coordinate = [&](size_t axis) { return static_cast<float>(numbers_[layout_.position[axis]] - view_.origin[axis]); };
    mesh_.positions.push_back({coordinate(0), coordinate(1), coordinate(2)});
    const auto number = [&](size_t p) { return static_cast<float>(numbers_[p]); };
    if (layout_.normal) mesh_.normals.push_back({number((*layout_.normal)[0]), number((*layout_.normal)[1]), number((*layout_.normal)[2])});
    if (layout_.uv) mesh_.uvs.push_back({number((*layout_.uv)[0]), number((*layout_.uv)[1])});
    if (!layout_.vertex_color) return;
    const auto primary = [&](size_t i) { return numbers_[(*layout_.vertex_color)[i]] / view_.color_scale; };
    mesh_.colors.push_back(pack_color(primary(0), primary(1), primary(2)));
}

void PlyMesh::add_face() {
    vertices_.clear();
    for (const int64_t corner : corners_) vertices_.push_back(vertex_number(corner));
    colors_.clear();
    if (layout_.wedge_colors && wedges_.size() >= 3 * vertices_.size() && !vertices_.empty()) {
        // Three or four numbers a corner.
        const size_t stride = wedges_.size() / vertices_.size();
        for (size_t i = 0; i < vertices_.size(); ++i) colors_.push_back(of_wedges_.add(&wedges_[i * stride]));
    } else if (layout_.face_color) {
        const auto& properties = *layout_.face_color;
        const double color[3] = {numbers_[properties[0]], numbers_[properties[1]], numbers_[properties[2]]};
        colors_.assign(vertices_.size(), of_faces_.add(color) | face_bit);
    }
    if (has_corner_uvs()) add_corner_uvs();
    polygons_.add(vertices_, colors_);
}

size_t PlyMesh::HashOfCorner::operator()(const Corner& corner) const {
    const uint64_t bits = uint64_t{std::bit_cast<uint32_t>(corner.uv.x)} << 32 | std::bit_cast<uint32_t>(corner.uv.y);
    return (bits ^ corner.face * 0x9e3779b97f4a7c15ull ^ corner.color * 0xbf58476d1ce4e5b9ull) * 0xff51afd7ed558ccdull >> 16;
}

uint32_t PlyMesh::corner_number(const Corner& corner) {
    const auto [known, is_new] = numbers_of_corners_.try_emplace(corner, static_cast<uint32_t>(corners_with_uvs_.size()));
    if (is_new) corners_with_uvs_.push_back(corner);
    return known->second;
}

// What were colours of corners become numbers among corners_with_uvs_.
void PlyMesh::add_corner_uvs() {
    constexpr Float2 square[] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}}, middle = {0.5f, 0.5f};
    colors_.resize(vertices_.size(), RP_NONE);
    const double number = layout_.face_number ? numbers_[*layout_.face_number] : static_cast<double>(faces_);
    const uint64_t face = view_.faces && number >= 0 && number < RP_NONE ? static_cast<uint64_t>(number) : 0;
    faces_++;
    for (size_t i = 0; i < vertices_.size(); ++i) {
        Float2 uv;
        if (view_.faces) {
            const bool has_own = layout_.uv && vertices_[i] < mesh_.uvs.size();
            uv = has_own ? mesh_.uvs[vertices_[i]] : vertices_.size() <= 4 ? square[i] : middle;
        } else if (wedge_uvs_.size() >= 2 * vertices_.size()) {
            uv = {static_cast<float>(wedge_uvs_[2 * i]), static_cast<float>(wedge_uvs_[2 * i + 1])};
        }
        colors_[i] = corner_number({face, uv, colors_[i]});
    }
}

// Vertices are split where corners differ in colours or coordinates. Which colours are equal is known only now, when all have been seen.
void PlyMesh::place_corners() {
    const std::vector<Corner> found = std::exchange(corners_with_uvs_, {});
    numbers_of_corners_.clear();
    std::vector<uint32_t> numbers;
    for (Corner corner : found) {
        if (corner.color != RP_NONE) corner.color = packed(corner.color);
        numbers.push_back(corner_number(corner));
    }
    for (Triangle& corners : polygons_.attributes())
        for (uint32_t& number : corners) number = number == RP_NONE ? RP_NONE : numbers[number];
    const SplitVertices split = split_vertices(mesh_.triangles, polygons_.attributes(), mesh_.positions.size());
    append_copies(mesh_.positions, split);
    if (!mesh_.normals.empty()) append_copies(mesh_.normals, split);
    if (!mesh_.colors.empty()) append_copies(mesh_.colors, split);
    if (mesh_.colors.empty() && (layout_.face_color || layout_.wedge_colors)) mesh_.colors.assign(mesh_.positions.size(), 0xffffffu);
    mesh_.uvs.assign(mesh_.positions.size(), Float2{});
    for (size_t i = 0; i < mesh_.uvs.size(); ++i) {
        if (split.attribute[i] == RP_NONE) continue;
        const auto& [face, uv, color] = corners_with_uvs_[split.attribute[i]];
        mesh_.uvs[i] = view_.faces ? view_.faces->place(face, uv.x, uv.y) : uv;
        if (color != RP_NONE) mesh_.colors[i] = color;
    }
}

// -1 ends a strip and begins another. In types that have no -1 it looks like their largest number.
void PlyMesh::add_strip() {
    int64_t end = -1;
    if (last_type_ == PlyType::uint8) end = 0xff;
    if (last_type_ == PlyType::uint16) end = 0xffff;
    if (last_type_ == PlyType::uint32) end = 0xffffffff;
    if (end >= 0 && static_cast<uint64_t>(end) < layout_.vertices->count) end = -1;
    size_t length = 0;
    for (size_t i = 0; i < corners_.size(); ++i) {
        length = corners_[i] == end || corners_[i] == -1 ? 0 : length + 1;
        if (length < 3) continue;
        const uint32_t a = vertex_number(corners_[i - 2]), b = vertex_number(corners_[i - 1]), c = vertex_number(corners_[i]);
        // Vertices that come twice join strips, and no triangles are lost without those.
        if (a == b || b == c || c == a) continue;
        const bool turned = length % 2 == 0;  // every other triangle is
        vertices_.assign({turned ? b : a, turned ? a : b, c});
        polygons_.add(vertices_);
    }
}

uint32_t PlyMesh::Colors::add(const double* color) {
    const std::array<float, 3> c = {static_cast<float>(color[0]), static_cast<float>(color[1]), static_cast<float>(color[2])};
    if (numbers.empty() || numbers.back() != c) numbers.push_back(c);
    largest = std::max<double>({largest, c[0], c[1], c[2]});
    return static_cast<uint32_t>(numbers.size() - 1) & ~face_bit;
}

uint32_t PlyMesh::Colors::packed(uint32_t index, PlyType type) const {
    const double scale = ply_color_scale(type, largest);
    const auto& c = numbers[index];
    return pack_color(c[0] / scale, c[1] / scale, c[2] / scale);
}

// Of the number of a colour of a face or corner.
uint32_t PlyMesh::packed(uint32_t color) const {
    const auto type = [&](size_t property) { return layout_.faces->properties[property].type; };
    return color & face_bit ? of_faces_.packed(color & ~face_bit, type((*layout_.face_color)[0]))
                            : of_wedges_.packed(color, type(*layout_.wedge_colors));
}

void PlyMesh::finish() {
    polygons_.cut_concave();
    if (has_corner_uvs()) {
        if (!polygons_.attributes().empty()) place_corners();
        return;
    }
    for (Triangle& corners : polygons_.attributes())
        for (uint32_t& color : corners) color = color == RP_NONE ? RP_NONE : packed(color);
    color_corners(mesh_, polygons_);
}

}  // namespace raypager
