// Surfaces at the hits of a stream.
#ifndef RP_WIDE_SURFACE_CL
#define RP_WIDE_SURFACE_CL

#ifndef RP_SURFACE_LANES
#define RP_SURFACE_LANES
#endif
#include "lib/surface.cl"
#include "lib/wide_leaf.cl"

#define RP_LANES 16
#include "lib/surface_lanes.cl"
#undef RP_LANES

// Of all rays; meaningful for those that have a hit in this launch.
typedef struct rp_wide_surfaces {
    float position[3][RP_STREAM_RAYS];
    uint geometric_normal[RP_STREAM_RAYS], shading_normal[RP_STREAM_RAYS], offset_exponent[RP_STREAM_RAYS];
} rp_wide_surfaces;

static inline rp_triangle rp_leaf_triangle(const __global rp_wide_leaf* leaf, uint k) {
    const __global float* at = rp_leaf_coordinates(leaf);
    const __global uchar* corners = rp_leaf_corners(leaf);
    const uint vertices = leaf->vertices, count = leaf->count;
    const uint number[3] = {corners[k], corners[count + k], corners[2u * count + k]};
    rp_triangle triangle;
    for (uint i = 0u; i < 3u; i++) {
        triangle.corner[i] = (float3)(at[number[i]], at[vertices + number[i]], at[2u * vertices + number[i]]);
        triangle.normal[i] = leaf->flags & RP_WIDE_NORMALS ? rp_leaf_ids(leaf)[count + number[i]] : RP_NONE;
    }
    return triangle;
}

static inline void rp_set_sphere_surface(const rp_stream* s, uint r, const __global rp_wide_leaf* leaf, rp_wide_surfaces* surfaces) {
    const rp_ray ray = rp_ray_of_stream(s, r);
    const rp_surface surface =
        rp_sphere_surface(&ray, rp_leaf_spheres(leaf)[rp_hit_number(s, r)], leaf->flags & RP_WIDE_POINTS ? RP_LEAF_POINTS : 0u, RP_OF_RAY(s->t, r));
    surfaces->position[0][r] = surface.position.x;
    surfaces->position[1][r] = surface.position.y;
    surfaces->position[2][r] = surface.position.z;
    surfaces->geometric_normal[r] = surface.geometric_normal;
    surfaces->shading_normal[r] = surface.shading_normal;
    surfaces->offset_exponent[r] = surface.offset_exponent;
}

// Of one packet: triangles together, then what is special.
static inline void rp_find_packet_surfaces(const rp_stream* s, uint p, rp_wide_surfaces* surfaces) {
    float corner[3][3][RP_PACKET_RAYS];
    const uint hits = rp_mask16((s->hit_low[p] | s->hit_high[p]) != 0u);
    if (hits == 0u) return;
    uint special = 0u, others = ~hits & 0xffffu;
    for (uint left = hits; left != 0u; left &= left - 1u) {
        const uint lane = rp_lowest(left), r = RP_PACKET_RAYS * p + lane;
        const __global rp_wide_leaf* leaf = rp_hit_leaf(s, r);
        if (leaf->kind == RP_WIDE_SPHERES || leaf->flags & RP_WIDE_NORMALS) special |= 1u << lane;
        if (leaf->kind == RP_WIDE_SPHERES) {
            others |= 1u << lane;
            continue;
        }
        const rp_triangle triangle = rp_leaf_triangle(leaf, rp_hit_number(s, r));
        for (uint i = 0u; i < 3u; i++) {
            corner[i][0][lane] = triangle.corner[i].x;
            corner[i][1][lane] = triangle.corner[i].y;
            corner[i][2][lane] = triangle.corner[i].z;
        }
    }
    // For these any triangle will do.
    for (; others != 0u; others &= others - 1u)
        for (uint i = 0u; i < 9u; i++) corner[i / 3u][i % 3u][rp_lowest(others)] = i % 4u == 0u ? 1.0f : 0.0f;
    const rp_vector_16 origin = {s->origin[0][p], s->origin[1][p], s->origin[2][p]};
    const rp_vector_16 direction = {s->direction[0][p], s->direction[1][p], s->direction[2][p]};
    rp_vector_16 corners[3];
    for (uint i = 0u; i < 3u; i++) {
        corners[i].x = vload16(0, corner[i][0]);
        corners[i].y = vload16(0, corner[i][1]);
        corners[i].z = vload16(0, corner[i][2]);
    }
    const rp_triangle_point_16 point = rp_point_on_triangle_16(origin, direction, corners[0], corners[1], corners[2]);
    vstore16(point.position.x, p, surfaces->position[0]);
    vstore16(point.position.y, p, surfaces->position[1]);
    vstore16(point.position.z, p, surfaces->position[2]);
    vstore16(point.normal, p, surfaces->geometric_normal);
    vstore16(point.normal, p, surfaces->shading_normal);
    vstore16(point.offset_exponent, p, surfaces->offset_exponent);
    if (special == 0u) return;
    float b[RP_PACKET_RAYS], c[RP_PACKET_RAYS];
    int turns[RP_PACKET_RAYS];
    vstore16(point.b, 0, b);
    vstore16(point.c, 0, c);
    vstore16(point.turns, 0, turns);
    for (; special != 0u; special &= special - 1u) {
        const uint lane = rp_lowest(special), r = RP_PACKET_RAYS * p + lane;
        const __global rp_wide_leaf* leaf = rp_hit_leaf(s, r);
        if (leaf->kind == RP_WIDE_SPHERES) {
            rp_set_sphere_surface(s, r, leaf, surfaces);
        } else {
            const rp_triangle triangle = rp_leaf_triangle(leaf, rp_hit_number(s, r));
            surfaces->shading_normal[r] = rp_shading_normal(&triangle, (uint)turns[lane], b[lane], c[lane], surfaces->geometric_normal[r]);
        }
    }
}

static inline void rp_find_surfaces(const rp_stream* s, rp_wide_surfaces* surfaces) {
    for (uint p = 0u; p < RP_PACKETS; p++) rp_find_packet_surfaces(s, p, surfaces);
}

#endif
