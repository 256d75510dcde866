// Rays against the leaves of a block: strips of up to four triangles, or up to four spheres.
#ifndef RP_LEAF_CL
#define RP_LEAF_CL

#include "lib/geometry.cl"

// The closest hit so far.
typedef struct rp_hit {
    float t;
    uint primitive;  // scene-wide id, decides between equal distances; RP_NONE: no hit
    uint ref;        // leaf and primitive within it, if found_in is not RP_NONE
    uint found_in;   // page address of the block in which this launch found the hit; RP_NONE: found earlier, or no hit
} rp_hit;

static inline float3 as_float3_xyz(uint4 v) { return as_float3(v.xyz); }

// Byte k (0 to 5) of the leaf's vertex indices, as an offset into the floats of its cluster.
static inline uint rp_vertex_offset(uint2 leaf, uint k) { return 3u * (k < 2u ? leaf.x >> (16u + 8u * k) & 255u : leaf.y >> (8u * (k - 2u)) & 255u); }
static inline const __global float* rp_cluster(const rp_block_view* block, uint2 leaf) {
    return block->vertices + (leaf.x & 0xffffu) * (3u * RP_CLUSTER_UNIT);
}

// Calls ACTION(k, t) for each primitive k that the ray hits at t in (0, t_limit].
#define RP_FOR_EACH_HIT(ACTION)                                                                              \
    const uint2 leaf = block->leaves[rp_leaf_index(ref)];                                                    \
    const uint count = (ref & 3u) + 1u;                                                                      \
    if (ref & RP_LEAF_SPHERES) {                                                                             \
        for (uint k = 0u; k < count; k++) {                                                                  \
            const float t = rp_hit_sphere(ray, rp_sphere(block->base, leaf, k));                             \
            if (t > 0.0f && t <= t_limit) ACTION(k, t);                                                      \
        }                                                                                                    \
    } else {                                                                                                 \
        const __global float* cluster = rp_cluster(block, leaf);                                             \
        const float3 p0 = rp_load3(cluster + rp_vertex_offset(leaf, 0u)), p1 = rp_load3(cluster + rp_vertex_offset(leaf, 1u)); \
        float3 next = rp_load3(cluster + rp_vertex_offset(leaf, 2u));                                        \
        rp_sheared a = rp_shear_vertex(shear, p0), b = rp_shear_vertex(shear, p1);                           \
        for (uint k = 0u;;) {                                                                                \
            const rp_sheared c = rp_shear_vertex(shear, next);                                               \
            /* Unused index bytes repeat the last vertex, so that this load is always in range. */           \
            next = rp_load3(cluster + rp_vertex_offset(leaf, min(k + 3u, 5u)));                              \
            const float t = rp_hit_triangle(shear, &a, &b, &c);                                              \
            if (t > 0.0f && t <= t_limit) ACTION(k, t);                                                      \
            if (++k == count) break;                                                                         \
            if (!(ref >> (1u + k) & 1u)) a = b;                                                              \
            b = c;                                                                                           \
        }                                                                                                    \
    }

static inline void rp_leaf_closest(const rp_ray* ray, const rp_shear* shear, const rp_block_view* block, uint block_address, uint ref, rp_hit* best) {
    float t_limit = best->t;
#define RP_KEEP_CLOSEST(k, distance)                                  \
    {                                                                 \
        const uint id = rp_primitive_id(block->base, ref, k);         \
        if (distance < t_limit || id < best->primitive) {             \
            best->t = t_limit = distance;                             \
            best->primitive = id;                                     \
            best->ref = (ref & ~3u) | k;                              \
            best->found_in = block_address;                           \
        }                                                             \
    }
    RP_FOR_EACH_HIT(RP_KEEP_CLOSEST)
}

static inline bool rp_leaf_any(const rp_ray* ray, const rp_shear* shear, const rp_block_view* block, uint ref, float t_limit) {
#define RP_TAKE_ANY(k, distance) return true
    RP_FOR_EACH_HIT(RP_TAKE_ANY)
    return false;
}

#endif
