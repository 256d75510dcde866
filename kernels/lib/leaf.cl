// Rays against the leaves of a block: strips of up to four triangles, or runs of up to sixteen spheres.
#ifndef RP_LEAF_CL
#define RP_LEAF_CL

#include "lib/geometry.cl"

// The closest hit so far.
typedef struct rp_hit {
    float t;
    uint primitive;  // scene-wide id, decides between equal distances; RP_NONE: no hit. Not kept while found_in is not RP_NONE:
    uint ref;        // of the leaf, with the triangle instead of their number, or the sphere instead of the first, if found_in is not RP_NONE
    uint found_in;   // the block in which this launch found the hit; RP_NONE: found earlier, or no hit
} rp_hit;

// The id of the closest hit so far. To be looked up only where it matters: it costs two dependent loads.
static inline uint rp_hit_primitive(const rp_geometry* g, const rp_hit* hit) {
    return hit->found_in == RP_NONE ? hit->primitive : rp_primitive_id(rp_block_address(g, g->pages[hit->found_in].x), hit->ref);
}

static inline float3 as_float3_xyz(uint4 v) { return as_float3(v.xyz); }

// Byte k (0 to 5) of the leaf's vertex indices, as an offset into the floats of its cluster.
static inline uint rp_vertex_offset(uint2 leaf, uint k) { return 3u * (k < 2u ? leaf.x >> (16u + 8u * k) & 255u : leaf.y >> (8u * (k - 2u)) & 255u); }
static inline const __global float* rp_cluster(const rp_block_view* block, uint2 leaf) {
    return (const __global float*)(block->base + block->vertices_at) + (leaf.x & 0xffffu) * (3u * RP_CLUSTER_UNIT);
}

// Which triangles of a strip the ray's line may hit, as bits. The rest of the test is for these alone (rp_strip_hit): lanes of a GPU that ran
// into it at different triangles of their strips would wait for each other at each of them.
static inline uint rp_strip_candidates(const rp_ray* ray, const rp_shear* shear, const rp_block_view* block, uint ref) {
    const uint2 leaf = rp_leaf_record(block, ref);
    const uint count = (ref & 3u) + 1u;
    // All loads before the first test. Unused index bytes repeat the last vertex, so every load is in range.
    const __global float* cluster = rp_cluster(block, leaf);
    const float3 p0 = rp_load3(cluster + rp_vertex_offset(leaf, 0u)), p1 = rp_load3(cluster + rp_vertex_offset(leaf, 1u));
    const float3 p2 = rp_load3(cluster + rp_vertex_offset(leaf, 2u)), p3 = rp_load3(cluster + rp_vertex_offset(leaf, 3u));
    const float3 p4 = rp_load3(cluster + rp_vertex_offset(leaf, 4u)), p5 = rp_load3(cluster + rp_vertex_offset(leaf, 5u));
    rp_sheared a = rp_shear_vertex(ray, shear, p0), b = rp_shear_vertex(ray, shear, p1), c = rp_shear_vertex(ray, shear, p2);
    uint found = rp_may_hit_triangle(&a, &b, &c) ? 1u : 0u;
#define RP_NEXT_TRIANGLE(k, position)                          \
    if (count > k) {                                           \
        if (!(ref >> (1u + k) & 1u)) a = b;                    \
        b = c;                                                 \
        c = rp_shear_vertex(ray, shear, position);             \
        if (rp_may_hit_triangle(&a, &b, &c)) found |= 1u << k; \
    }
    RP_NEXT_TRIANGLE(1u, p3)
    RP_NEXT_TRIANGLE(2u, p4)
    RP_NEXT_TRIANGLE(3u, p5)
#undef RP_NEXT_TRIANGLE
    return found;
}

// Triangle k of a strip has the vertices k + 1, k + 2, and this one: the last one up to k at which no switch is set (abi/block.h).
static inline uint rp_strip_first_vertex(uint ref, uint k) { return 31u - clz((~(ref >> 2) << 1 | 1u) & ((2u << k) - 1u)); }

// Distance at which the ray hits triangle k of a strip, or -1.
static inline float rp_strip_hit(const rp_ray* ray, const rp_shear* shear, const rp_block_view* block, uint ref, uint k) {
    const uint2 leaf = rp_leaf_record(block, ref);
    const __global float* cluster = rp_cluster(block, leaf);
    const rp_sheared a = rp_shear_vertex(ray, shear, rp_load3(cluster + rp_vertex_offset(leaf, rp_strip_first_vertex(ref, k))));
    const rp_sheared b = rp_shear_vertex(ray, shear, rp_load3(cluster + rp_vertex_offset(leaf, k + 1u)));
    const rp_sheared c = rp_shear_vertex(ray, shear, rp_load3(cluster + rp_vertex_offset(leaf, k + 2u)));
    return rp_hit_triangle(ray, shear, &a, &b, &c);
}

static inline uint rp_lowest_bit(uint bits) { return 31u - clz(bits & -bits); }

static inline void rp_strip_closest(const rp_geometry* g, const rp_ray* ray, const rp_shear* shear, const rp_block_view* block, uint block_index, uint ref,
                                    rp_hit* best) {
    for (uint left = rp_strip_candidates(ray, shear, block, ref); left != 0u; left &= left - 1u) {
        const uint k = rp_lowest_bit(left);
        const float t = rp_strip_hit(ray, shear, block, ref, k);
        if (!(t > 0.0f && t <= best->t)) continue;
        if (t < best->t || rp_triangle_id(block->base, (ref & ~3u) | k) < rp_hit_primitive(g, best)) {
            best->t = t;
            best->ref = (ref & ~3u) | k;
            best->found_in = block_index;
        }
    }
}

static inline bool rp_strip_any(const rp_ray* ray, const rp_shear* shear, const rp_block_view* block, uint ref, float t_limit) {
    for (uint left = rp_strip_candidates(ray, shear, block, ref); left != 0u; left &= left - 1u) {
        const float t = rp_strip_hit(ray, shear, block, ref, rp_lowest_bit(left));
        if (t > 0.0f && t <= t_limit) return true;
    }
    return false;
}

static inline uint rp_sphere_count(uint ref) { return (ref & (RP_LEAF_MAX_SPHERES - 1u)) + 1u; }
// The leaf's reference with the index of one of its spheres in place of the first.
static inline uint rp_sphere_ref(uint ref, uint index) { return (ref & ~(RP_LEAF_INDEX_MASK << RP_LEAF_INDEX_SHIFT)) | index << RP_LEAF_INDEX_SHIFT; }

static inline void rp_spheres_closest(const rp_geometry* g, const rp_ray* ray, const rp_block_view* block, uint block_index, uint ref, rp_hit* best) {
    const uint first = rp_leaf_index(ref), end = first + rp_sphere_count(ref);
    const __global uint4* spheres = rp_spheres(block->base);
    for (uint i = first; i < end; i++) {
        const float t = rp_hit_sphere(ray, rp_decode_sphere(spheres[i], ref));
        if (!(t > 0.0f && t <= best->t)) continue;
        if (t < best->t || rp_sphere_id(block->base, i) < rp_hit_primitive(g, best)) {
            best->t = t;
            best->ref = rp_sphere_ref(ref, i);
            best->found_in = block_index;
        }
    }
}

static inline bool rp_spheres_any(const rp_ray* ray, const rp_block_view* block, uint ref, float t_limit) {
    const uint first = rp_leaf_index(ref), end = first + rp_sphere_count(ref);
    const __global uint4* spheres = rp_spheres(block->base);
    for (uint i = first; i < end; i++) {
        const float t = rp_hit_sphere(ray, rp_decode_sphere(spheres[i], ref));
        if (t > 0.0f && t <= t_limit) return true;
    }
    return false;
}

static inline void rp_leaf_closest(const rp_geometry* g, const rp_ray* ray, const rp_shear* shear, const rp_block_view* block, uint block_index, uint ref,
                                   rp_hit* best) {
    if (ref & RP_LEAF_SPHERES) rp_spheres_closest(g, ray, block, block_index, ref, best);
    else rp_strip_closest(g, ray, shear, block, block_index, ref, best);
}

static inline bool rp_leaf_any(const rp_ray* ray, const rp_shear* shear, const rp_block_view* block, uint ref, float t_limit) {
    return ref & RP_LEAF_SPHERES ? rp_spheres_any(ray, block, ref, t_limit) : rp_strip_any(ray, shear, block, ref, t_limit);
}

#endif
