// What the corners of the faces of an OBJ file name beside a vertex: a normal, coordinates of textures, or both.
#pragma once

#include <cstdint>
#include <vector>

#include "import/index_table.hpp"
#include "import/polygons.hpp"
#include "raypager/scene.hpp"

namespace raypager {

class ObjCorners {
public:
    // Statements, in order. Equal ones are one, so that the corners that name them share their vertices.
    void add_normal(const Float3& normal);
    void add_uv(const Float2& uv);
    uint64_t normals() const { return normal_numbers_.size(); }
    uint64_t uvs() const { return uv_numbers_.size(); }

    // The attributes of a polygon's corners (polygons.hpp), from the numbers of statements, RP_NONE where a corner names none. Statements may still
    // be to come. As long as no corner names coordinates the number of its normal will do; what `before` has of earlier corners is changed by the
    // first one that does.
    const std::vector<uint32_t>& attributes(std::vector<Triangle>& before, const std::vector<uint32_t>& uvs, const std::vector<uint32_t>& normals);

    // At the end: vertices are split where their corners differ. keep_uvs: if not, all is as if there were no coordinates.
    void split(TriangleMesh& mesh, std::vector<Triangle>& attributes, bool keep_uvs);

private:
    struct Pair {
        uint32_t uv, normal;
        bool operator==(const Pair&) const = default;
    };
    static uint32_t find_or_add(std::vector<Pair>& pairs, IndexTable& known, const Pair& pair);
    uint32_t different_normal(uint32_t statement) const;
    void number(std::vector<Triangle>& attributes, bool keep_uvs);
    Pair pair(uint32_t attribute) const { return has_pairs_ ? pairs_[attribute] : Pair{RP_NONE, attribute}; }

    std::vector<Float3> normals_;  // those that differ
    std::vector<Float2> uvs_;
    std::vector<uint32_t> normal_numbers_, uv_numbers_;  // of statements
    IndexTable known_normals_, known_uvs_, known_pairs_;
    bool has_pairs_ = false;   // attributes are numbers of pairs
    std::vector<Pair> pairs_;  // of statements; from number() on, of what differs
    std::vector<uint32_t> attributes_;
};

}  // namespace raypager
