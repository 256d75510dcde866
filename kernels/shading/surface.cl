// What shading needs to know of a hit, read from the block while it is resident.
#ifndef RP_SURFACE_CL
#define RP_SURFACE_CL

#include "common/leaf.cl"
#ifdef RP_INSTANCES
#include "common/instance.cl"
#endif
#include "common/normal.cl"

#ifdef RP_UVS
// Where a hit lies in textures.
typedef struct rp_texture_place {
    float2 uv;      // (0, 0) where a triangle has no coordinates, and of spheres
    float density;  // square root of the area in textures that a unit of area takes up there; 0 where that says nothing
#ifdef RP_TANGENTS
    uint tangent;  // octahedral: where u grows fastest along the triangle while v stays; RP_NONE: nowhere
#endif
} rp_texture_place;

static inline rp_texture_place rp_no_texture_place(void) {
    rp_texture_place place;
    place.uv = (float2)(0.0f);
    place.density = 0.0f;
#ifdef RP_TANGENTS
    place.tangent = RP_NONE;
#endif
    return place;
}
#endif

typedef struct rp_surface {
    float3 position;
    uint geometric_normal, shading_normal;  // octahedral; of a point: its word (abi/block.h), with its colour, in place of the shading normal
    // 2^(offset_exponent - 150) bounds the rounding error of position along the normal: rays that start here are moved by it.
    uint offset_exponent;
#ifdef RP_VERTEX_COLORS
    uint color;  // of a triangle: see rp_blend_colors
#endif
#ifdef RP_UVS
    float2 uv;  // these as in rp_texture_place
    float density;
#ifdef RP_TANGENTS
    uint tangent;
#endif
#endif
} rp_surface;

#ifdef RP_UVS
static inline void rp_place_in_texture(rp_surface* s, rp_texture_place place) {
    s->uv = place.uv;
    s->density = place.density;
#ifdef RP_TANGENTS
    s->tangent = place.tangent;
#endif
}
#endif

static inline float rp_offset_distance(uint offset_exponent) { return ldexp(1.0f, (int)offset_exponent - 150); }

// Without fused operations, so that it makes no difference which kernel a compiler has put these into: on some devices the surface at a hit is
// found by the stage `shade`, or, if the ray has to wait then, by `extend`.
static inline float3 rp_scaled(float s, float3 v) { return (float3)(rp_mul(s, v.x), rp_mul(s, v.y), rp_mul(s, v.z)); }
static inline float3 rp_sum(float3 a, float3 b) { return (float3)(rp_add(a.x, b.x), rp_add(a.y, b.y), rp_add(a.z, b.z)); }
static inline float rp_squared_length(float3 v) { return rp_add(rp_add(rp_mul(v.x, v.x), rp_mul(v.y, v.y)), rp_mul(v.z, v.z)); }
static inline float3 rp_normalized(float3 v) { return rp_scaled(rp_div(1.0f, rp_sqrt(rp_squared_length(v))), v); }
static inline float rp_largest(float3 v) { return rp_max(rp_max(fabs(v.x), fabs(v.y)), fabs(v.z)); }

// Where the normals, or the colours, of a leaf's vertices begin, if its block has any.
static inline const __global uint* rp_leaf_attributes(const __global rp_block_header* header, uint2 leaf, bool colors) {
    const uint skipped = colors && (header->flags & RP_BLOCK_NORMALS) ? header->vertex_count : 0u;
#ifdef RP_UVS
    const uint at = RP_BLOCK_ATTRIBUTES_AT(header->attributes_at);
#else
    const uint at = header->attributes_at;  // in scenes without coordinates of textures no block has the bit
#endif
    return (const __global uint*)((const __global uchar*)header + at) + skipped + (leaf.x & 0xffffu) * RP_CLUSTER_UNIT;
}

#ifdef RP_UVS
// Likewise the coordinates of textures: two numbers a vertex.
static inline const __global float* rp_leaf_uvs(const __global rp_block_header* header, uint2 leaf) {
    const uint words = (header->flags & RP_BLOCK_NORMALS ? 1u : 0u) + (header->flags & RP_BLOCK_COLORS ? 1u : 0u);
    const __global uchar* attributes = (const __global uchar*)header + RP_BLOCK_ATTRIBUTES_AT(header->attributes_at);
    return (const __global float*)attributes + words * header->vertex_count + 2u * (leaf.x & 0xffffu) * RP_CLUSTER_UNIT;
}
#endif

// Which vertices of a strip's leaf are the corners of triangle ref & 3, in its true orientation.
static inline uint3 rp_strip_corners(uint ref) {
    const uint k = ref & 3u, a = rp_strip_first_vertex(ref, k), b = k + 1u, c = k + 2u;
    // The orientation turns with each triangle before it whose switch is clear.
    const uint turns = popcount(~(ref >> 2) & ((1u << k) - 1u)) + (ref & RP_LEAF_WINDING ? 1u : 0u);
    return turns & 1u ? (uint3)(a, c, b) : (uint3)(a, b, c);
}

#ifdef RP_VERTEX_COLORS
// The colour between three corners, with the weights b and c of the second and third, from their colours (abi/block.h): square roots of linear
// reflectances, of 11, 11 and 10 bits, so that gradients have no steps. Without fused operations, as above.
static inline uint rp_blend_colors(uint first, uint second, uint third, float b, float c) {
    const float a = 1.0f - b - c;
    uint blended = 0u;
    for (uint k = 0u; k < 3u; k++) {
        const float x = (float)(first >> 8u * k & 255u), y = (float)(second >> 8u * k & 255u), z = (float)(third >> 8u * k & 255u);
        const float linear = rp_add(rp_add(rp_mul(a, rp_mul(x, x)), rp_mul(b, rp_mul(y, y))), rp_mul(c, rp_mul(z, z)));
        const float most = k == 2u ? 1023.0f : 2047.0f, root = rp_mul(rp_sqrt(rp_max(linear, 0.0f)), rp_div(most, 255.0f));
        blended |= (uint)rp_min(rp_add(root, 0.5f), most) << 11u * k;
    }
    return blended;
}
static inline float3 rp_blended_reflectance(uint color) {
    const float3 root = (float3)((float)(color & 2047u) / 2047.0f, (float)(color >> 11 & 2047u) / 2047.0f, (float)(color >> 22) / 1023.0f);
    return root * root;
}
#endif

#define RP_LANES 1
#include "shading/surface_lanes.cl"
#undef RP_LANES

// A triangle in its true orientation, with the octahedral normals of its corners (RP_NONE: none).
typedef struct rp_triangle {
    float3 corner[3];
    uint normal[3];
#ifdef RP_VERTEX_COLORS
    uint color[3];
#endif
#ifdef RP_UVS
    float2 uv[3];
#endif
} rp_triangle;

// Triangle ref & 3 of a strip.
static inline rp_triangle rp_strip_triangle(const rp_block_view* block, uint ref) {
    const uint2 leaf = rp_leaf_record(block, ref);
    const uint3 corners = rp_strip_corners(ref);
    const uint number[3] = {rp_vertex_number(leaf, corners.x), rp_vertex_number(leaf, corners.y), rp_vertex_number(leaf, corners.z)};
    const rp_vertices vertices = rp_leaf_vertices(block, leaf);
    const __global uchar* const base = rp_block_of_nodes(block->nodes);
    const __global rp_block_header* const header = (const __global rp_block_header*)base;
    const __global uint* normals = rp_leaf_attributes(header, leaf, false);
    const bool has_normals = (header->flags & RP_BLOCK_NORMALS) != 0u;
    rp_triangle triangle;
    for (uint i = 0u; i < 3u; i++) {
        triangle.corner[i] = rp_vertex(&vertices, number[i]);
        triangle.normal[i] = has_normals ? normals[number[i]] : RP_NONE;
    }
#ifdef RP_VERTEX_COLORS
    const __global uint* colors = rp_leaf_attributes(header, leaf, true);
    for (uint i = 0u; i < 3u; i++) triangle.color[i] = header->flags & RP_BLOCK_COLORS ? colors[number[i]] : RP_NONE;
#endif
#ifdef RP_UVS
    const __global float* uvs = rp_leaf_uvs(header, leaf);
    const bool has_uvs = RP_BLOCK_HAS_UVS(header->attributes_at);
    for (uint i = 0u; i < 3u; i++) triangle.uv[i] = has_uvs ? (float2)(uvs[2u * number[i]], uvs[2u * number[i] + 1u]) : (float2)(0.0f);
#endif
    return triangle;
}

// What three corners have, beginning with one of them. Not by an index: GPUs keep arrays in memory that are read so.
static inline uint3 rp_turned(const uint* of, uint turns) {
    return turns == 0u ? (uint3)(of[0], of[1], of[2]) : turns == 1u ? (uint3)(of[1], of[2], of[0]) : (uint3)(of[2], of[0], of[1]);
}

// The shading normal between the corners, whose first by position is `turns` from the first by number; `normal` if they have none.
static inline uint rp_shading_normal(const rp_triangle* triangle, uint turns, float b, float c, uint normal) {
    const uint3 of = rp_turned(triangle->normal, turns);
    if (of.x == RP_NONE || of.y == RP_NONE || of.z == RP_NONE) return normal;
    const float3 n =
        rp_sum(rp_sum(rp_scaled(1.0f - b - c, rp_decode_normal(of.x)), rp_scaled(b, rp_decode_normal(of.y))), rp_scaled(c, rp_decode_normal(of.z)));
    return rp_squared_length(n) > 1e-12f ? rp_encode_normal(n) : normal;
}

#ifdef RP_VERTEX_COLORS
// Likewise of the colour.
static inline uint rp_triangle_color(const rp_triangle* triangle, uint turns, float b, float c) {
    const uint3 of = rp_turned(triangle->color, turns);
    return rp_blend_colors(of.x, of.y, of.z, b, c);
}
#endif

#ifdef RP_UVS
// Likewise where it lies in textures. Like the colour without fused operations.
static inline rp_texture_place rp_triangle_texture(const rp_triangle* triangle, uint turns, float b, float c) {
    const float3* p = triangle->corner;
    const float2* t = triangle->uv;
    const float2 uv0 = turns == 0u ? t[0] : turns == 1u ? t[1] : t[2], uv1 = turns == 0u ? t[1] : turns == 1u ? t[2] : t[0];
    const float2 uv2 = turns == 0u ? t[2] : turns == 1u ? t[0] : t[1], d1 = uv1 - uv0, d2 = uv2 - uv0;
    const float3 p0 = turns == 0u ? p[0] : turns == 1u ? p[1] : p[2], p1 = turns == 0u ? p[1] : turns == 1u ? p[2] : p[0];
    const float3 p2 = turns == 0u ? p[2] : turns == 1u ? p[0] : p[1];
    rp_texture_place place = rp_no_texture_place();
    place.uv.x = rp_add(uv0.x, rp_add(rp_mul(b, d1.x), rp_mul(c, d2.x)));
    place.uv.y = rp_add(uv0.y, rp_add(rp_mul(b, d1.y), rp_mul(c, d2.y)));
    // Edges are brought near to 1 by a power of two, so that no product of them is too small or too large.
    const float3 e1 = p1 - p0, e2 = p2 - p0;
    const float scale = as_float(0x7f000000u - (as_uint(rp_max(rp_largest(e1), rp_largest(e2))) & 0x7f800000u));
    const float3 s1 = rp_scaled(scale, e1), s2 = rp_scaled(scale, e2);
    const float3 normal = (float3)(rp_add(rp_mul(s1.y, s2.z), -rp_mul(s1.z, s2.y)), rp_add(rp_mul(s1.z, s2.x), -rp_mul(s1.x, s2.z)),
                                   rp_add(rp_mul(s1.x, s2.y), -rp_mul(s1.y, s2.x)));
    const float in_space = rp_sqrt(rp_squared_length(normal)), in_texture = rp_add(rp_mul(d1.x, d2.y), -rp_mul(d1.y, d2.x));
    const float density = rp_mul(rp_sqrt(rp_div(fabs(in_texture), in_space)), scale);
    if (in_space > 0.0f && density <= FLT_MAX) place.density = density;
#ifdef RP_TANGENTS
    const float3 along = rp_scaled(in_texture < 0.0f ? -1.0f : 1.0f, rp_sum(rp_scaled(d2.y, s1), rp_scaled(-d1.y, s2)));
    const float largest = rp_largest(along);
    if (in_texture != 0.0f && largest > 0.0f && largest <= FLT_MAX) {
        const float3 near_one = rp_scaled(as_float(0x7f000000u - (as_uint(largest) & 0x7f800000u)), along);
        const uint code = rp_encode_normal(near_one);
        place.tangent = code == RP_NONE ? 0x0000ffffu : code;  // the neighbouring code, as for normals
    }
#endif
    return place;
}
#endif

static inline rp_surface rp_triangle_surface(const rp_ray* ray, const rp_block_view* block, uint ref) {
    const rp_triangle triangle = rp_strip_triangle(block, ref);
    const rp_vector_1 a = rp_vector_of(triangle.corner[0]), b = rp_vector_of(triangle.corner[1]), c = rp_vector_of(triangle.corner[2]);
    const rp_triangle_point_1 point = rp_point_on_triangle_1(rp_vector_of(ray->origin), rp_vector_of(ray->direction), a, b, c);
    rp_surface s;
    s.position = (float3)(point.position.x, point.position.y, point.position.z);
    s.geometric_normal = point.normal;
    s.shading_normal = rp_shading_normal(&triangle, (uint)point.turns, point.b, point.c, point.normal);
    s.offset_exponent = point.offset_exponent;
#ifdef RP_VERTEX_COLORS
    s.color = rp_triangle_color(&triangle, (uint)point.turns, point.b, point.c);
#endif
#ifdef RP_UVS
    rp_place_in_texture(&s, rp_triangle_texture(&triangle, (uint)point.turns, point.b, point.c));
#endif
    return s;
}

// record: rp_sphere. ref: of its leaf.
static inline rp_surface rp_sphere_surface(const rp_ray* ray, uint4 record, uint ref, float t) {
    const float4 sphere = rp_decode_sphere(record, ref);
    const float3 normal = rp_normalized(rp_sum(ray->origin, rp_scaled(t, ray->direction)) - sphere.xyz);
    rp_surface s;
    s.position = rp_sum(sphere.xyz, rp_scaled(sphere.w, normal));
    s.geometric_normal = rp_encode_normal(normal);
    s.shading_normal = ref & RP_LEAF_POINTS ? record.w : s.geometric_normal;
    s.offset_exponent = rp_offset_exponent_1(rp_largest(sphere.xyz) + sphere.w);
#ifdef RP_VERTEX_COLORS
    s.color = RP_NONE;
#endif
#ifdef RP_UVS
    rp_place_in_texture(&s, rp_no_texture_place());
#endif
    return s;
}

static inline rp_surface rp_hit_surface(const rp_geometry* g, const rp_ray* ray, const rp_hit* hit) {
    const rp_block_view block = rp_view_block(g, g->pages[hit->found_in]);
#ifndef RP_ONLY_TRIANGLES
    if (hit->what & RP_LEAF_SPHERES) {
        const uint4 sphere = rp_spheres(rp_block_of_nodes(block.nodes))[rp_leaf_index(hit->what)];
        return rp_sphere_surface(ray, sphere, hit->what, hit->t);
    }
#endif
    return rp_triangle_surface(ray, &block, hit->what);
}

#ifdef RP_INSTANCES
#include "shading/instance_surface.cl"
#endif

#endif
