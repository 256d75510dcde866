// Surfaces at the hits of a stream.
#ifndef RP_WIDE_SURFACE_CL
#define RP_WIDE_SURFACE_CL

#include "shading/surface.cl"
#include "stream/wide_leaf.cl"

// As many hits at a time as registers have lanes: with twice as many most of the time went into putting registers aside.
#ifndef RP_SURFACE_HITS
#ifdef RP_AVX512
#define RP_SURFACE_HITS 16
#else
#define RP_SURFACE_HITS 8
#endif
#endif
#define RP_LANES RP_SURFACE_HITS
#include "common/normal_lanes.cl"
#include "shading/surface_lanes.cl"
#undef RP_LANES

// Of all rays; meaningful for those that have a hit in this launch.
typedef struct rp_wide_surfaces {
    float position[3][RP_STREAM_RAYS];
    uint geometric_normal[RP_STREAM_RAYS], shading_normal[RP_STREAM_RAYS], offset_exponent[RP_STREAM_RAYS];
#ifdef RP_VERTEX_COLORS
    uint color[RP_STREAM_RAYS];
#endif
#ifdef RP_UVS
    rp_texture_place texture[RP_STREAM_RAYS];
#define RP_WIDE_SPECIAL (RP_WIDE_NORMALS | RP_WIDE_COLORS | RP_WIDE_UVS)
#else
#define RP_WIDE_SPECIAL (RP_WIDE_NORMALS | RP_WIDE_COLORS)
#endif
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
#ifdef RP_VERTEX_COLORS
    const __global uint* colors = rp_leaf_ids(leaf) + count + (leaf->flags & RP_WIDE_NORMALS ? vertices : 0u);
    for (uint i = 0u; i < 3u; i++) triangle.color[i] = leaf->flags & RP_WIDE_COLORS ? colors[number[i]] : RP_NONE;
#endif
#ifdef RP_UVS
    const uint words = (leaf->flags & RP_WIDE_NORMALS ? 1u : 0u) + (leaf->flags & RP_WIDE_COLORS ? 1u : 0u);
    const __global float* uvs = (const __global float*)rp_leaf_ids(leaf) + count + words * vertices;
    const bool has_uvs = (leaf->flags & RP_WIDE_UVS) != 0u;
    for (uint i = 0u; i < 3u; i++) triangle.uv[i] = has_uvs ? (float2)(uvs[number[i]], uvs[vertices + number[i]]) : (float2)(0.0f);
#endif
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

#define RP_LANES RP_SURFACE_HITS
#include "common/begin_lanes.cl"
// Of the rays from `first` on: triangles together, then what is special.
static inline void rp_find_some_surfaces(const rp_stream* s, uint first, rp_wide_surfaces* surfaces) {
    const uint hits = RP_NAME(rp_mask)((RP_LOAD((const uint*)s->hit_low + first) | RP_LOAD((const uint*)s->hit_high + first)) != 0u);
    if (hits == 0u) return;
    float corner[9][RP_SURFACE_HITS];
    uint special = 0u;
    for (uint lane = 0u; lane < RP_SURFACE_HITS; lane++) {
        const uint r = first + lane;
        const bool hit = (hits >> lane & 1u) != 0u;
        const __global rp_wide_leaf* leaf = rp_hit_leaf(s, r);
        if (hit && (leaf->kind == RP_WIDE_SPHERES || leaf->flags & RP_WIDE_SPECIAL)) special |= 1u << lane;
        if (!hit || leaf->kind == RP_WIDE_SPHERES) {
            for (uint i = 0u; i < 9u; i++) corner[i][lane] = i % 4u == 0u ? 1.0f : 0.0f;  // any triangle will do
            continue;
        }
        const rp_triangle triangle = rp_leaf_triangle(leaf, rp_hit_number(s, r));
        for (uint i = 0u; i < 3u; i++) {
            corner[3u * i][lane] = triangle.corner[i].x;
            corner[3u * i + 1u][lane] = triangle.corner[i].y;
            corner[3u * i + 2u][lane] = triangle.corner[i].z;
        }
    }
    RP_NAME(rp_vector_) corners[3];
    for (uint i = 0u; i < 3u; i++) {
        corners[i].x = RP_LOAD(corner[3u * i]);
        corners[i].y = RP_LOAD(corner[3u * i + 1u]);
        corners[i].z = RP_LOAD(corner[3u * i + 2u]);
    }
    const float *o = (const float*)s->origin + first, *d = (const float*)s->direction + first;
    const RP_NAME(rp_vector_) origin = {RP_LOAD(o), RP_LOAD(o + RP_STREAM_RAYS), RP_LOAD(o + 2u * RP_STREAM_RAYS)};
    const RP_NAME(rp_vector_) direction = {RP_LOAD(d), RP_LOAD(d + RP_STREAM_RAYS), RP_LOAD(d + 2u * RP_STREAM_RAYS)};
    const RP_NAME(rp_triangle_point_) point = RP_NAME(rp_point_on_triangle_)(origin, direction, corners[0], corners[1], corners[2]);
    RP_STORE(point.position.x, surfaces->position[0] + first);
    RP_STORE(point.position.y, surfaces->position[1] + first);
    RP_STORE(point.position.z, surfaces->position[2] + first);
    RP_STORE(point.normal, surfaces->geometric_normal + first);
    RP_STORE(point.normal, surfaces->shading_normal + first);
    RP_STORE(point.offset_exponent, surfaces->offset_exponent + first);
#ifdef RP_UVS
    for (uint lane = 0u; lane < RP_SURFACE_HITS; lane++) surfaces->texture[first + lane] = rp_no_texture_place();
#endif
    if (special == 0u) return;
    float b[RP_SURFACE_HITS], c[RP_SURFACE_HITS];
    int turns[RP_SURFACE_HITS];
    RP_STORE(point.b, b);
    RP_STORE(point.c, c);
    RP_STORE(point.turns, turns);
    for (; special != 0u; special &= special - 1u) {
        const uint lane = rp_lowest(special), r = first + lane;
        const __global rp_wide_leaf* leaf = rp_hit_leaf(s, r);
        if (leaf->kind == RP_WIDE_SPHERES) {
            rp_set_sphere_surface(s, r, leaf, surfaces);
        } else {
            const rp_triangle triangle = rp_leaf_triangle(leaf, rp_hit_number(s, r));
            surfaces->shading_normal[r] = rp_shading_normal(&triangle, (uint)turns[lane], b[lane], c[lane], surfaces->geometric_normal[r]);
#ifdef RP_VERTEX_COLORS
            surfaces->color[r] = rp_triangle_color(&triangle, (uint)turns[lane], b[lane], c[lane]);
#endif
#ifdef RP_UVS
            surfaces->texture[r] = rp_triangle_texture(&triangle, (uint)turns[lane], b[lane], c[lane]);
#endif
        }
    }
}
#include "common/end_lanes.cl"
#undef RP_LANES

static inline void rp_find_surfaces(const rp_stream* s, rp_wide_surfaces* surfaces) {
    for (uint first = 0u; first < RP_STREAM_RAYS; first += RP_SURFACE_HITS) rp_find_some_surfaces(s, first, surfaces);
}

#ifdef RP_INSTANCES
// Likewise where some hits are in instances. scratch: for the rays in the spaces of these.
static inline void rp_find_surfaces_in_world(const rp_geometry* g, const rp_stream* s, rp_stream* scratch, rp_wide_surfaces* surfaces) {
    ulong inside = 0ul;
    for (uint p = 0u; p < RP_PACKETS; p++)
        inside |= (ulong)rp_mask16((s->hit_instance_low[p] | s->hit_instance_high[p]) != 0u) << (RP_PACKET_RAYS * p);
    if (inside == 0ul) {
        rp_find_surfaces(s, surfaces);
        return;
    }
    *scratch = *s;
    for (ulong left = inside; left != 0ul; left &= left - 1ul) {
        const uint r = rp_lowest(left);
        const __global rp_instance* const instance = rp_hit_instance(s, r);
        const rp_ray ray = rp_ray_of_stream(s, r);
        const rp_placed_ray placed = rp_place_ray(instance, rp_load3(g->objects[instance->object].base), ray.origin, ray.direction);
        RP_SET_OF_RAY(scratch->origin[0], r, placed.origin.x);
        RP_SET_OF_RAY(scratch->origin[1], r, placed.origin.y);
        RP_SET_OF_RAY(scratch->origin[2], r, placed.origin.z);
        RP_SET_OF_RAY(scratch->direction[0], r, placed.direction.x);
        RP_SET_OF_RAY(scratch->direction[1], r, placed.direction.y);
        RP_SET_OF_RAY(scratch->direction[2], r, placed.direction.z);
        RP_SET_OF_RAY(scratch->t, r, rp_add(RP_OF_RAY(s->t, r), -placed.start));
    }
    rp_find_surfaces(scratch, surfaces);
    for (ulong left = inside; left != 0ul; left &= left - 1ul) {
        const uint r = rp_lowest(left);
        const __global rp_instance* const instance = rp_hit_instance(s, r);
        const __global rp_wide_leaf* const leaf = rp_hit_leaf(s, r);
        rp_surface surface;
        surface.position = (float3)(surfaces->position[0][r], surfaces->position[1][r], surfaces->position[2][r]);
        surface.geometric_normal = surfaces->geometric_normal[r];
        surface.shading_normal = surfaces->shading_normal[r];
#ifdef RP_UVS
        surface.density = surfaces->texture[r].density;
#ifdef RP_TANGENTS
        surface.tangent = surfaces->texture[r].tangent;
#endif
#endif
        const bool points = leaf->kind == RP_WIDE_SPHERES && (leaf->flags & RP_WIDE_POINTS) != 0u;
        rp_move_to_world(instance, rp_load3(g->objects[instance->object].base), points ? RP_LEAF_SPHERES | RP_LEAF_POINTS : 0u,
                         rp_largest(surface.position), &surface);
        surfaces->position[0][r] = surface.position.x;
        surfaces->position[1][r] = surface.position.y;
        surfaces->position[2][r] = surface.position.z;
        surfaces->geometric_normal[r] = surface.geometric_normal;
        surfaces->shading_normal[r] = surface.shading_normal;
        surfaces->offset_exponent[r] = surface.offset_exponent;
#ifdef RP_UVS
        surfaces->texture[r].density = surface.density;
#ifdef RP_TANGENTS
        surfaces->texture[r].tangent = surface.tangent;
#endif
#endif
    }
}
#endif

#endif
