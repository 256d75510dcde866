// What leaves of the stored tree hold, and what a leaf record of the wide tree has room for.
#pragma once

#include <cstdint>

#include "raypager/abi/block.h"
#include "raypager/abi/wide.h"

namespace raypager {

// What a subtree of the stored tree holds.
struct LeafContent {
    uint32_t triangles = 0, spheres = 0, points = 0;
    uint32_t vertices = 0;  // of all strips, shared ones counted once a strip
    uint32_t instances = 0;
    void add(const LeafContent& other) {
        triangles += other.triangles;
        spheres += other.spheres;
        points += other.points;
        vertices += other.vertices;
        instances += other.instances;
    }
};

// flags: bits 0-6 of the reference to a leaf.
inline uint32_t triangles_of_leaf(rp_u32 flags) { return (flags & (RP_LEAF_MAX_PRIMITIVES - 1)) + 1; }
inline uint32_t spheres_of_leaf(rp_u32 flags) { return (flags & (RP_LEAF_MAX_SPHERES - 1)) + 1; }
inline LeafContent content_of_leaf(rp_u32 flags) {
    LeafContent content;
    if (flags & RP_LEAF_SPHERES) {
        (flags & RP_LEAF_POINTS ? content.points : content.spheres) = spheres_of_leaf(flags);
    } else {
        content.triangles = triangles_of_leaf(flags);
        content.vertices = content.triangles + 2;
    }
    return content;
}

// How full a leaf record of the wide tree is (abi/wide.h).
struct WideLeafSize {
    uint32_t triangles = 0, vertices = 0, spheres = 0;
    bool has_normals = false, has_colors = false, has_uvs = false, are_points = false;

    // What a stored leaf adds, but for its vertices; false, and nothing is added, if it does not go into the record.
    bool add(rp_u32 flags) {
        const uint32_t count = flags & RP_LEAF_SPHERES ? spheres_of_leaf(flags) : triangles_of_leaf(flags);
        if (flags & RP_LEAF_SPHERES) {
            const bool points = flags & RP_LEAF_POINTS;
            if (triangles > 0 || spheres + count > RP_WIDE_LEAF_SPHERES || (spheres > 0 && points != are_points)) return false;
            are_points = points;
            spheres += count;
        } else {
            if (spheres > 0 || triangles + count > RP_WIDE_LEAF_TRIANGLES) return false;
            triangles += count;
        }
        return true;
    }

    // Where the parts of the record lie, and its end.
    struct Places {
        uint32_t first;  // positions of vertices and then corners, or spheres
        uint32_t ids, normals, colors, uvs, end;
    };
    Places places() const {
        constexpr auto up_to = [](uint32_t value, uint32_t unit) { return (value + unit - 1) / unit * unit; };
        constexpr auto head = static_cast<uint32_t>(sizeof(rp_wide_leaf)), sphere = static_cast<uint32_t>(sizeof(rp_sphere));
        Places at = {};
        if (triangles > 0) {
            at.first = head;
            at.ids = up_to(at.first + vertices * 3 * 4 + triangles * 3, 4);
            at.normals = at.ids + triangles * 4;
            at.colors = at.normals + (has_normals ? vertices * 4 : 0);
            at.uvs = at.colors + (has_colors ? vertices * 4 : 0);
            at.end = at.uvs + (has_uvs ? vertices * 2 * 4 : 0);
        } else {
            at.first = up_to(head, sphere);
            at.ids = at.first + spheres * sphere;
            at.end = at.ids + spheres * 4;
        }
        at.end = up_to(at.end, RP_WIDE_UNIT);
        return at;
    }
};

}  // namespace raypager
