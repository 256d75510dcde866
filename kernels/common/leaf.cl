// Rays against the leaves of a block: strips of up to four triangles, or runs of up to sixteen spheres.
#ifndef RP_LEAF_CL
#define RP_LEAF_CL

#include "common/bits.cl"
#include "common/geometry.cl"
#ifdef RP_CUTOUTS
#include "common/primitive_ranges.cl"
#endif

// The closest hit so far.
typedef struct rp_hit {
    float t;
    // Of a hit that this launch found, the leaf's reference, with the triangle instead of their number, or the sphere instead of the first.
    // Of one that was found earlier its primitive's scene-wide id, which decides between equal distances; RP_NONE: no hit.
    uint what;
    uint found_in;  // the block in which this launch found the hit; RP_NONE: found earlier, or no hit
#ifdef RP_INSTANCES
    const __global rp_instance* instance;  // of a hit that this launch found; 0: in the world
    // Numbers decide between equal distances before the id does.
#if RP_INSTANCE_LEVELS > 1
    rp_instance_chain chain;  // of a hit that this launch found, ends with `instance`
#else
    uint number;  // of the instance in which it is + 1, or 0
#endif
#endif
} rp_hit;

// The id of the closest hit so far. To be looked up only where it matters: it costs two dependent loads.
static inline uint rp_hit_primitive(const rp_geometry* g, const rp_hit* hit) {
    return hit->found_in == RP_NONE ? hit->what : rp_primitive_id(rp_block_address(g, g->pages[hit->found_in].x), hit->what);
}

// Whether the ray's hit on a primitive is the one that counts, at the distance of the closest so far.
static inline bool rp_comes_first(const rp_geometry* g, const rp_ray* ray, uint id, const rp_hit* best) {
#ifdef RP_INSTANCES
#if RP_INSTANCE_LEVELS > 1
    for (uint i = 0u; i < RP_INSTANCE_LEVELS; i++)
        if (ray->chain.number[i] != best->chain.number[i]) return ray->chain.number[i] < best->chain.number[i];
#else
    if (ray->number != best->number) return ray->number < best->number;
#endif
#endif
    return id < rp_hit_primitive(g, best);
}
static inline void rp_take_hit(rp_hit* best, const rp_ray* ray, float t, uint ref, uint block) {
    best->t = t;
    best->what = ref;
    best->found_in = block;
#ifdef RP_INSTANCES
    best->instance = ray->instance;
#if RP_INSTANCE_LEVELS > 1
    best->chain = ray->chain;
#else
    best->number = ray->number;
#endif
#endif
}
// Distance along the ray in the world. ahead: along this one, or -1.
static inline float rp_distance(const rp_ray* ray, float ahead) {
#ifdef RP_INSTANCES
    return ahead > 0.0f ? rp_add(ray->start, ahead) : ahead;
#else
    return ahead;
#endif
}

static inline float3 as_float3_xyz(uint4 v) { return as_float3(v.xyz); }

// The vertices of leaves, by their bytes in the leaf's record (0 to 5) and where its cluster begins.
static inline uint rp_vertex_number(uint2 leaf, uint k) { return rp_any_byte(leaf, 2u + k); }
#ifdef RP_CODED_POSITIONS
typedef struct rp_vertices {
    const __global uchar* section;
    uint first;  // of the cluster
    uint flags;  // of the block, as all that follows
    float3 base;
    float cell;
} rp_vertices;
static inline rp_vertices rp_leaf_vertices(const rp_block_view* block, uint2 leaf) {
    const __global rp_block_header* header = (const __global rp_block_header*)rp_block_of_nodes(block->nodes);
    rp_vertices v;
    v.section = (const __global uchar*)block->nodes + block->vertices_at;
    v.first = (leaf.x & 0xffffu) * RP_CLUSTER_UNIT;
    v.flags = header->flags;
    v.base = (float3)(header->origin[3], header->cell[3], header->lower[3]);
    v.cell = header->upper[3];
    return v;
}
// A number of so many bits (RP_POSITION_MAX_BITS at most), as a float. GPUs take longer to convert.
static inline float rp_position_number(ulong word, uint bits) {
    return as_float(0x4b000000u | ((uint)word & ((1u << bits) - 1u))) - as_float(0x4b000000u);
}
static inline float3 rp_vertex(const rp_vertices* v, uint number) {
    const uint stride = RP_POSITION_STRIDE(v->flags), index = v->first + number;
    if (stride == 0u) return rp_load3((const __global float*)v->section + 3u * index);
    // Two words, the second of which may belong to the ids behind.
    const uint at = index * stride;
    const __global uint* const words = (const __global uint*)(v->section + (at & ~3u));
    ulong word = ((ulong)words[1] << 32 | words[0]) >> ((at & 3u) << 3);
    const uint x_bits = RP_POSITION_BITS(v->flags, 0), y_bits = RP_POSITION_BITS(v->flags, 1), z_bits = RP_POSITION_BITS(v->flags, 2);
    // Both products and sums are exact, fused or not.
    float3 position = v->base;
    position.x += rp_position_number(word, x_bits) * v->cell;
    word >>= x_bits;
    position.y += rp_position_number(word, y_bits) * v->cell;
    position.z += rp_position_number(word >> y_bits, z_bits) * v->cell;
    return position;
}
#else
// Counted in floats, to be added up in 32 bits, in which GPUs have one instruction less for each vertex.
typedef struct rp_vertices {
    const __global float* section;
    uint first;
} rp_vertices;
static inline rp_vertices rp_leaf_vertices(const rp_block_view* block, uint2 leaf) {
    rp_vertices v;
    v.section = (const __global float*)((const __global uchar*)block->nodes + block->vertices_at);
    v.first = (leaf.x & 0xffffu) * (3u * RP_CLUSTER_UNIT);
    return v;
}
static inline float3 rp_vertex(const rp_vertices* v, uint number) { return rp_load3(v->section + (v->first + 3u * number)); }
#endif

// Which triangles of a strip the ray's line may hit, as bits. The rest of the test is for these alone (rp_strip_hit): work-items of a sub-group
// that ran into it at different triangles of their strips would wait for each other at each of them.
static inline uint rp_strip_candidates(const rp_ray* ray, const rp_shear* shear, const rp_block_view* block, uint ref) {
    const uint2 leaf = rp_leaf_record(block, ref);
    const uint count = (ref & 3u) + 1u;
    // All loads before the first test. Unused index bytes repeat the last vertex, so every load is in range.
    const rp_vertices vertices = rp_leaf_vertices(block, leaf);
#define RP_VERTEX(k) rp_vertex(&vertices, rp_byte(leaf, 2u + k))
    const float3 p0 = RP_VERTEX(0u), p1 = RP_VERTEX(1u), p2 = RP_VERTEX(2u), p3 = RP_VERTEX(3u), p4 = RP_VERTEX(4u), p5 = RP_VERTEX(5u);
#undef RP_VERTEX
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
    const rp_vertices vertices = rp_leaf_vertices(block, leaf);
    const rp_sheared a = rp_shear_vertex(ray, shear, rp_vertex(&vertices, rp_vertex_number(leaf, rp_strip_first_vertex(ref, k))));
    const rp_sheared b = rp_shear_vertex(ray, shear, rp_vertex(&vertices, rp_vertex_number(leaf, k + 1u)));
    const rp_sheared c = rp_shear_vertex(ray, shear, rp_vertex(&vertices, rp_vertex_number(leaf, k + 2u)));
    return rp_hit_triangle(ray, shear, &a, &b, &c);
}

static inline void rp_strip_closest(const rp_geometry* g, const rp_ray* ray, const rp_shear* shear, const rp_block_view* block, uint block_index,
                                    uint ref, rp_hit* best) {
    for (uint left = rp_strip_candidates(ray, shear, block, ref); left != 0u; left &= left - 1u) {
        const uint k = rp_lowest_bit(left);
        const float t = rp_distance(ray, rp_strip_hit(ray, shear, block, ref, k));
        if (!(t > 0.0f && t <= best->t)) continue;
        if (t < best->t || rp_comes_first(g, ray, rp_triangle_id(rp_block_of_nodes(block->nodes), (ref & ~3u) | k), best))
            rp_take_hit(best, ray, t, (ref & ~3u) | k, block_index);
    }
}

// What is asked of a leaf for a shadow ray.
typedef struct rp_any_search {
    float t_limit;
#ifdef RP_CUTOUTS
    const __global rp_primitive_range* ranges;
    uint range_count;
    bool met_cutout;  // it has met something that may be nothing, and passed that
#endif
} rp_any_search;

// Whether a primitive that is hit stops the ray. ref: as in rp_hit.
static inline bool rp_stops(rp_any_search* search, const rp_block_view* block, uint ref) {
#ifdef RP_CUTOUTS
    if (rp_may_be_nothing(search->ranges, search->range_count, rp_primitive_id(rp_block_of_nodes(block->nodes), ref))) {
        search->met_cutout = true;
        return false;
    }
#endif
    return true;
}

static inline bool rp_strip_any(const rp_ray* ray, const rp_shear* shear, const rp_block_view* block, uint ref, rp_any_search* search) {
    for (uint left = rp_strip_candidates(ray, shear, block, ref); left != 0u; left &= left - 1u) {
        const uint k = rp_lowest_bit(left);
        const float t = rp_distance(ray, rp_strip_hit(ray, shear, block, ref, k));
        if (t > 0.0f && t <= search->t_limit && rp_stops(search, block, (ref & ~3u) | k)) return true;
    }
    return false;
}

static inline uint rp_sphere_count(uint ref) { return (ref & (RP_LEAF_MAX_SPHERES - 1u)) + 1u; }
// The leaf's reference with the index of one of its spheres in place of the first.
static inline uint rp_sphere_ref(uint ref, uint index) { return (ref & ~(RP_LEAF_INDEX_MASK << RP_LEAF_INDEX_SHIFT)) | index << RP_LEAF_INDEX_SHIFT; }

static inline void rp_spheres_closest(const rp_geometry* g, const rp_ray* ray, const rp_block_view* block, uint block_index, uint ref, rp_hit* best) {
    const uint first = rp_leaf_index(ref), end = first + rp_sphere_count(ref);
    const __global uint4* spheres = rp_spheres(rp_block_of_nodes(block->nodes));
    for (uint i = first; i < end; i++) {
        const float t = rp_distance(ray, rp_hit_sphere(ray, rp_decode_sphere(spheres[i], ref)));
        if (!(t > 0.0f && t <= best->t)) continue;
        if (t < best->t || rp_comes_first(g, ray, rp_sphere_id(rp_block_of_nodes(block->nodes), i), best))
            rp_take_hit(best, ray, t, rp_sphere_ref(ref, i), block_index);
    }
}

static inline bool rp_spheres_any(const rp_ray* ray, const rp_block_view* block, uint ref, rp_any_search* search) {
    const uint first = rp_leaf_index(ref), end = first + rp_sphere_count(ref);
    const __global uint4* spheres = rp_spheres(rp_block_of_nodes(block->nodes));
    for (uint i = first; i < end; i++) {
        const float t = rp_distance(ray, rp_hit_sphere(ray, rp_decode_sphere(spheres[i], ref)));
        if (t > 0.0f && t <= search->t_limit && rp_stops(search, block, rp_sphere_ref(ref, i))) return true;
    }
    return false;
}

static inline void rp_leaf_closest(const rp_geometry* g, const rp_ray* ray, const rp_shear* shear, const rp_block_view* block, uint block_index,
                                   uint ref, rp_hit* best) {
#ifndef RP_ONLY_TRIANGLES
    if (ref & RP_LEAF_SPHERES)
        rp_spheres_closest(g, ray, block, block_index, ref, best);
    else
#endif
        rp_strip_closest(g, ray, shear, block, block_index, ref, best);
}

static inline bool rp_leaf_any(const rp_ray* ray, const rp_shear* shear, const rp_block_view* block, uint ref, rp_any_search* search) {
#ifndef RP_ONLY_TRIANGLES
    if (ref & RP_LEAF_SPHERES) return rp_spheres_any(ray, block, ref, search);
#endif
    return rp_strip_any(ray, shear, block, ref, search);
}

#endif
