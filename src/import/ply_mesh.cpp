#include "import/ply_mesh.hpp"

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
    polygons_.add(vertices_, colors_);
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

void PlyMesh::finish() {
    polygons_.cut_concave();
    const auto type = [&](size_t property) { return layout_.faces->properties[property].type; };
    for (Triangle& corners : polygons_.attributes())
        for (uint32_t& color : corners) {
            if (color == RP_NONE) continue;
            color = color & face_bit ? of_faces_.packed(color & ~face_bit, type((*layout_.face_color)[0]))
                                     : of_wedges_.packed(color, type(*layout_.wedge_colors));
        }
    color_corners(mesh_, polygons_);
}

}  // namespace raypager
