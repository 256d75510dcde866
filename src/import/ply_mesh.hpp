// From the values of PLY items, whether they are text or binary, to a mesh.
#pragma once

#include <array>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "import/mesh_colors.hpp"
#include "import/mesh_readers.hpp"
#include "import/polygons.hpp"

namespace raypager {

// The number that stands for full brightness: 255 in bytes, else the smallest usual one that is not below the largest that occurs.
double ply_color_scale(PlyType type, double largest);

class PlyMesh {
public:
    PlyMesh(const PlyLayout& layout, const MeshView& view, MeshIssues& issues) : layout_(layout), view_(view), polygons_(mesh_, issues) {}
    PlyMesh(const PlyMesh&) = delete;
    PlyMesh& operator=(const PlyMesh&) = delete;

    // One item of any element, property by property. Values has
    //   Status number(PlyType, double&)      the next value
    //   Status index(PlyType, int64_t&)      the next value, of a list of indices
    //   Status length(PlyType, PlyType, uint64_t&)   the length of a list of values of the second type, which are known to be there
    //   Status skip(PlyType, uint64_t)       passes over so many values
    template <class Values>
    Status read_item(const PlyElement& element, Values& values) {
        const bool vertex = &element == layout_.vertices, face = &element == layout_.faces, strip = &element == layout_.strips;
        numbers_.assign(element.properties.size(), 0.0);
        corners_.clear();
        wedges_.clear();
        wedge_uvs_.clear();
        for (size_t p = 0; p < element.properties.size(); ++p) {
            const PlyProperty& property = element.properties[p];
            if (!property.count_type) {
                if (vertex || face)
                    RAYPAGER_TRY(values.number(property.type, numbers_[p]));
                else
                    RAYPAGER_TRY(values.skip(property.type, 1));
                continue;
            }
            uint64_t count = 0;
            RAYPAGER_TRY(values.length(*property.count_type, property.type, count));
            if ((face && p == layout_.indices) || (strip && p == layout_.strip_indices)) {
                corners_.resize(count);
                for (int64_t& corner : corners_) RAYPAGER_TRY(values.index(property.type, corner));
                last_type_ = property.type;
            } else if (face && p == layout_.wedge_colors) {
                wedges_.resize(count);
                for (double& number : wedges_) RAYPAGER_TRY(values.number(property.type, number));
            } else if (face && p == layout_.wedge_uvs) {
                wedge_uvs_.resize(count);
                for (double& number : wedge_uvs_) RAYPAGER_TRY(values.number(property.type, number));
            } else {
                RAYPAGER_TRY(values.skip(property.type, count));
            }
        }
        if (vertex) add_vertex();
        if (face) add_face();
        if (strip) add_strip();
        return {};
    }

    // The whole of it, once all items have been read.
    void finish();

    TriangleMesh& mesh() { return mesh_; }
    PolygonBuilder& polygons() { return polygons_; }

private:
    void add_vertex();
    void add_face();
    void add_strip();
    // Corners have coordinates of textures of their own.
    bool has_corner_uvs() const { return layout_.wedge_uvs || (view_.faces && view_.uvs); }
    void add_corner_uvs();
    void place_corners();
    uint32_t vertex_number(int64_t index) const { return index < 0 || index >= RP_NONE ? RP_NONE : static_cast<uint32_t>(index); }

    const PlyLayout& layout_;
    const MeshView view_;
    TriangleMesh mesh_;
    PolygonBuilder polygons_;
    std::vector<double> numbers_, wedges_, wedge_uvs_;  // of an item
    std::vector<int64_t> corners_;
    PlyType last_type_ = PlyType::int32;
    std::vector<uint32_t> vertices_, colors_;
    // As the file has them: what number stands for full brightness is known when the largest is. Until then attributes of corners are their places
    // here, with face_bit for those of whole faces.
    struct Colors {
        std::vector<std::array<float, 3>> numbers;
        double largest = 0;
        uint32_t add(const double* color);
        uint32_t packed(uint32_t index, PlyType type) const;
    };
    static constexpr uint32_t face_bit = 0x80000000u;
    Colors of_faces_, of_wedges_;
    uint32_t packed(uint32_t color) const;
    // What corners have, each once. With the faces of a Ptex file: u and v on the face. Colours: a number, in the end packed; RP_NONE: none.
    struct Corner {
        uint64_t face;
        Float2 uv;
        uint32_t color;
        bool operator==(const Corner&) const = default;
    };
    struct HashOfCorner {
        size_t operator()(const Corner& corner) const;
    };
    uint32_t corner_number(const Corner& corner);
    std::vector<Corner> corners_with_uvs_;
    std::unordered_map<Corner, uint32_t, HashOfCorner> numbers_of_corners_;
    uint64_t faces_ = 0;  // that came
};

}  // namespace raypager
