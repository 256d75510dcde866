// The rays of a stream against the primitives of a wide leaf.
#ifndef RP_WIDE_LEAF_CL
#define RP_WIDE_LEAF_CL

#include "common/noinline.cl"
#include "common/geometry.cl"
#include "stream/stream.cl"

#define RP_LANES 16
#include "common/triangle_lanes.cl"
#undef RP_LANES
// A ray alone: in sixteen lanes, where permutations have as many (two rays, if the leaf has no more than eight triangles); else eight triangles at a
// time.
#if !defined(RP_AVX512) && !defined(RP_EIGHT_LANES)
#define RP_EIGHT_LANES 1
#endif
#ifdef RP_EIGHT_LANES
#define RP_LANES 8
#include "common/triangle_lanes.cl"
#undef RP_LANES
#endif

// With fewer rays than this in a packet, each is tested alone against all triangles.
#ifndef RP_DENSE_TRIANGLES
#ifdef RP_AVX512
#define RP_DENSE_TRIANGLES 7
#else
#define RP_DENSE_TRIANGLES 12
#endif
#endif

// Which primitives of a leaf are tested, as bits.
#ifdef RP_CUTOUTS
#define RP_TESTED(stream, leaf) ((stream)->tested)
#else
#define RP_TESTED(stream, leaf) ((1u << (leaf)->count) - 1u)
#endif

// Where the parts of a leaf of triangles are.
static inline const __global float* rp_leaf_coordinates(const __global rp_wide_leaf* leaf) { return (const __global float*)(leaf + 1); }
static inline const __global uchar* rp_leaf_corners(const __global rp_wide_leaf* leaf) {
    return (const __global uchar*)(rp_leaf_coordinates(leaf) + 3u * leaf->vertices);
}
static inline const __global uint* rp_leaf_ids(const __global rp_wide_leaf* leaf) {
    return (const __global uint*)(rp_leaf_corners(leaf) + ((3u * leaf->count + 3u) & ~3u));
}
// Axis that is x or y where `axis` is z.
static inline uint rp_axis_x(uint axis) { return axis == 2u ? 0u : axis + 1u; }
static inline uint rp_axis_y(uint axis) { return axis == 0u ? 2u : axis - 1u; }

// As rp_comes_first.
static inline bool rp_comes_first_in_stream(const rp_stream* s, uint r, uint id) {
#ifdef RP_INSTANCES
    const uint number = ((const uint*)s->number)[r];
    if (s->instance_number != number) return s->instance_number < number;
#endif
    return id < ((const uint*)s->primitive)[r];
}

// The ray's hits in a leaf: keeps the closest one. lanes: triangles that are hit at distance[k].
static inline void rp_keep_closest(rp_stream* s, uint r, const __global rp_wide_leaf* leaf, const __global uint* ids, const float* distance,
                                   uint lanes) {
    do {
        const uint k = rp_lowest(lanes);
        lanes &= lanes - 1u;
        const float t = distance[k], limit = RP_OF_RAY(s->t, r);
        uint* primitive = (uint*)s->primitive + r;
        if (t < limit || (t == limit && rp_comes_first_in_stream(s, r, ids[k]))) {
            RP_SET_OF_RAY(s->t, r, t);
            *primitive = ids[k];
            const ulong place = (ulong)leaf | k;
            ((uint*)s->hit_low)[r] = (uint)place;
            ((uint*)s->hit_high)[r] = (uint)(place >> 32);
#ifdef RP_INSTANCES
            ((uint*)s->number)[r] = s->instance_number;
            ((uint*)s->hit_instance_low)[r] = (uint)s->instance;
            ((uint*)s->hit_instance_high)[r] = (uint)(s->instance >> 32);
#endif
        }
    } while (lanes != 0u);
}

#ifdef RP_EIGHT_LANES
// Corners of up to eight triangles of a leaf, by axis and by number of the corner.
typedef struct rp_eight_corners {
    float8 at[3][3];
} rp_eight_corners;

static inline float8 rp_corners_of_row(const __global float* row, uint8 index, const bool few) {
    // Loads reach past the end of a row, into what follows (RP_WIDE_GUARD); no triangle has those lanes for corners.
    return few ? rp_pick8(vload8(0, row), index) : rp_pick_of_two8(vload8(0, row), vload8(1, row), index);
}

// few: the leaf has no more than eight vertices.
static inline void rp_gather_rows(const __global rp_wide_leaf* leaf, const __global uchar* corners, const bool few, rp_eight_corners* out) {
    const uint count = leaf->count, vertices = leaf->vertices;
    const __global float* at = rp_leaf_coordinates(leaf);
    const uint8 a = convert_uint8(vload8(0, corners)), b = convert_uint8(vload8(0, corners + count)),
                c = convert_uint8(vload8(0, corners + 2u * count));
#pragma unroll
    for (uint axis = 0u; axis < 3u; axis++) {
        out->at[axis][0] = rp_corners_of_row(at + vertices * axis, a, few);
        out->at[axis][1] = rp_corners_of_row(at + vertices * axis, b, few);
        out->at[axis][2] = rp_corners_of_row(at + vertices * axis, c, few);
    }
}
// Not inlined: LLVM would make one of the two, with a branch for each row.
static RP_NOINLINE void rp_gather_corners_of_few(const __global rp_wide_leaf* leaf, const __global uchar* corners, rp_eight_corners* out) {
    rp_gather_rows(leaf, corners, true, out);
}
static RP_NOINLINE void rp_gather_corners(const __global rp_wide_leaf* leaf, const __global uchar* corners, rp_eight_corners* out) {
    rp_gather_rows(leaf, corners, false, out);
}

// One ray against up to eight triangles of a leaf, from number `first` on, those in `lanes`. True if any_hit is set and something is hit.
static inline bool rp_ray_hits_eight(rp_stream* s, uint r, const __global rp_wide_leaf* leaf, const rp_eight_corners* corners, uint lanes, uint first,
                                     const __global uint* ids, const bool any_hit) {
    const uint axis = RP_BYTE_OF_RAY(s->axis, r), ix = rp_axis_x(axis), iy = rp_axis_y(axis);
    const float8 *x = corners->at[ix], *y = corners->at[iy], *z = corners->at[axis];
    const float ox = RP_OF_RAY(s->origin[ix], r), oy = RP_OF_RAY(s->origin[iy], r), oz = RP_OF_RAY(s->origin[axis], r);
    const float shear_x = RP_OF_RAY(s->shear[0], r), shear_y = RP_OF_RAY(s->shear[1], r);
    const rp_vector_8 a = {x[0] - ox, y[0] - oy, z[0] - oz}, b = {x[1] - ox, y[1] - oy, z[1] - oz}, c = {x[2] - ox, y[2] - oy, z[2] - oz};
    rp_edges_8 edges;
    const uint inside = rp_inside_8(a.x - shear_x * a.z, a.y - shear_y * a.z, b.x - shear_x * b.z, b.y - shear_y * b.z, c.x - shear_x * c.z,
                                    c.y - shear_y * c.z, lanes, &edges);
    if (inside == 0u) return false;
    const rp_vector_8 inverse = {(float8)(RP_OF_RAY(s->inverse[ix], r)), (float8)(RP_OF_RAY(s->inverse[iy], r)),
                                 (float8)(RP_OF_RAY(s->inverse[axis], r))};
    float8 t;
    const uint in_front = rp_distance_8(&edges, &a, &b, &c, inverse, inside, &t);
    t = RP_IN_WORLD(s, r, t);
    const uint hit = in_front & rp_mask8(t <= RP_OF_RAY(s->t, r));
    if (hit == 0u) return false;
    if (any_hit) return true;
    float distance[RP_WIDE_LEAF_TRIANGLES];
    vstore8(t, 0, distance + first);
    rp_keep_closest(s, r, leaf, ids, distance, hit << first);
    return false;
}

// The rays, one after the other, against all triangles of a leaf, whose corners are gathered once for all of them. Returns those that hit
// something, if any_hit is set.
static inline ulong rp_rays_hit_triangles(rp_stream* s, ulong rays, const __global rp_wide_leaf* leaf, const __global uchar* corners,
                                          const __global uint* ids, const bool any_hit) {
    const uint count = leaf->count;
    ulong hit = 0ul;
    for (uint first = 0u; first < count && rays != 0ul; first += 8u) {
        rp_eight_corners eight;
        if (leaf->vertices <= 8u)
            rp_gather_corners_of_few(leaf, corners + first, &eight);
        else
            rp_gather_corners(leaf, corners + first, &eight);
        const uint lanes = RP_TESTED(s, leaf) >> first & 255u;
        for (ulong left = rays; left != 0ul; left &= left - 1ul) {
            const uint r = rp_lowest(left);
            if (rp_ray_hits_eight(s, r, leaf, &eight, lanes, first, ids, any_hit)) hit |= 1ul << r;
        }
        if (any_hit) rays &= ~hit;
    }
    return hit;
}
#else
// One ray against all triangles of a leaf. True if any_hit is set and something is hit.
static inline bool rp_ray_hits_triangles(rp_stream* s, uint r, const __global rp_wide_leaf* leaf, uint16 a, uint16 b, uint16 c,
                                         const __global uint* ids, const bool any_hit) {
    const uint axis = RP_BYTE_OF_RAY(s->axis, r), ix = rp_axis_x(axis), iy = rp_axis_y(axis), vertices = leaf->vertices;
    const __global float* at = rp_leaf_coordinates(leaf);
    // Loads reach past the end of a row, into what follows (RP_WIDE_GUARD); no triangle has those lanes for corners.
    const float16 rx = vload16(0, at + vertices * ix) - RP_OF_RAY(s->origin[ix], r),
                  ry = vload16(0, at + vertices * iy) - RP_OF_RAY(s->origin[iy], r);
    const float16 rz = vload16(0, at + vertices * axis) - RP_OF_RAY(s->origin[axis], r);
    const float16 x = rx - RP_OF_RAY(s->shear[0], r) * rz, y = ry - RP_OF_RAY(s->shear[1], r) * rz;
    rp_edges_16 edges;
    const uint inside = rp_inside_16(rp_pick16(x, a), rp_pick16(y, a), rp_pick16(x, b), rp_pick16(y, b), rp_pick16(x, c), rp_pick16(y, c),
                                     RP_TESTED(s, leaf), &edges);
    if (inside == 0u) return false;
    const rp_vector_16 pa = {rp_pick16(rx, a), rp_pick16(ry, a), rp_pick16(rz, a)}, pb = {rp_pick16(rx, b), rp_pick16(ry, b), rp_pick16(rz, b)};
    const rp_vector_16 pc = {rp_pick16(rx, c), rp_pick16(ry, c), rp_pick16(rz, c)};
    const rp_vector_16 inverse = {(float16)(RP_OF_RAY(s->inverse[ix], r)), (float16)(RP_OF_RAY(s->inverse[iy], r)),
                                  (float16)(RP_OF_RAY(s->inverse[axis], r))};
    float16 t;
    const uint in_front = rp_distance_16(&edges, &pa, &pb, &pc, inverse, inside, &t);
    t = RP_IN_WORLD(s, r, t);
    const uint hit = in_front & rp_mask16(t <= RP_OF_RAY(s->t, r));
    if (hit == 0u) return false;
    if (any_hit) return true;
    float distance[16];
    vstore16(t, 0, distance);
    rp_keep_closest(s, r, leaf, ids, distance, hit);
    return false;
}

// The vertices of a leaf as a ray sees them.
typedef struct rp_seen_vertices {
    float16 rx, ry, rz;  // relative to its origin, in Woop's order of axes
    float16 x, y;        // sheared
} rp_seen_vertices;

static inline rp_seen_vertices rp_see_vertices(const rp_stream* s, uint r, const __global rp_wide_leaf* leaf) {
    const uint axis = RP_BYTE_OF_RAY(s->axis, r), ix = rp_axis_x(axis), iy = rp_axis_y(axis), vertices = leaf->vertices;
    const __global float* at = rp_leaf_coordinates(leaf);
    rp_seen_vertices v;
    // Loads reach past the end of a row, into what follows (RP_WIDE_GUARD); no triangle has those lanes for corners.
    v.rx = vload16(0, at + vertices * ix) - RP_OF_RAY(s->origin[ix], r);
    v.ry = vload16(0, at + vertices * iy) - RP_OF_RAY(s->origin[iy], r);
    v.rz = vload16(0, at + vertices * axis) - RP_OF_RAY(s->origin[axis], r);
    v.x = v.rx - RP_OF_RAY(s->shear[0], r) * v.rz;
    v.y = v.ry - RP_OF_RAY(s->shear[1], r) * v.rz;
    return v;
}

static inline float16 rp_two8(float first, float second) { return (float16)((float8)(first), (float8)(second)); }
#define RP_PICK_OF_BOTH(member, index) rp_pick_of_two16(v.member, w.member, index)

// Two rays against all triangles of a leaf of up to eight. a, b, c: their corners, and again, plus 16. If any_hit is set, bits 0 and 1
// of the result tell whether the rays hit something.
static inline uint rp_two_rays_hit_triangles(rp_stream* s, uint r, uint q, const __global rp_wide_leaf* leaf, uint16 a, uint16 b, uint16 c,
                                             const __global uint* ids, const bool any_hit) {
    const rp_seen_vertices v = rp_see_vertices(s, r, leaf), w = rp_see_vertices(s, q, leaf);
    const uint lanes = RP_TESTED(s, leaf);
    rp_edges_16 edges;
    const uint inside = rp_inside_16(RP_PICK_OF_BOTH(x, a), RP_PICK_OF_BOTH(y, a), RP_PICK_OF_BOTH(x, b), RP_PICK_OF_BOTH(y, b),
                                     RP_PICK_OF_BOTH(x, c), RP_PICK_OF_BOTH(y, c), lanes | lanes << 8, &edges);
    if (inside == 0u) return 0u;
    const rp_vector_16 pa = {RP_PICK_OF_BOTH(rx, a), RP_PICK_OF_BOTH(ry, a), RP_PICK_OF_BOTH(rz, a)};
    const rp_vector_16 pb = {RP_PICK_OF_BOTH(rx, b), RP_PICK_OF_BOTH(ry, b), RP_PICK_OF_BOTH(rz, b)};
    const rp_vector_16 pc = {RP_PICK_OF_BOTH(rx, c), RP_PICK_OF_BOTH(ry, c), RP_PICK_OF_BOTH(rz, c)};
    const uint axis_r = RP_BYTE_OF_RAY(s->axis, r), axis_q = RP_BYTE_OF_RAY(s->axis, q);
    const rp_vector_16 inverse = {rp_two8(RP_OF_RAY(s->inverse[rp_axis_x(axis_r)], r), RP_OF_RAY(s->inverse[rp_axis_x(axis_q)], q)),
                                  rp_two8(RP_OF_RAY(s->inverse[rp_axis_y(axis_r)], r), RP_OF_RAY(s->inverse[rp_axis_y(axis_q)], q)),
                                  rp_two8(RP_OF_RAY(s->inverse[axis_r], r), RP_OF_RAY(s->inverse[axis_q], q))};
    float16 t;
    const uint in_front = rp_distance_16(&edges, &pa, &pb, &pc, inverse, inside, &t);
#ifdef RP_INSTANCES
    t += rp_two8(RP_OF_RAY(s->start, r), RP_OF_RAY(s->start, q));
#endif
    const uint hit = in_front & rp_mask16(t <= rp_two8(RP_OF_RAY(s->t, r), RP_OF_RAY(s->t, q)));
    if (hit == 0u) return 0u;
    if (any_hit) return ((hit & 0xffu) != 0u ? 1u : 0u) | ((hit & 0xff00u) != 0u ? 2u : 0u);
    float distance[16];
    vstore16(t, 0, distance);
    if (hit & 0xffu) rp_keep_closest(s, r, leaf, ids, distance, hit & 0xffu);
    if (hit & 0xff00u) rp_keep_closest(s, q, leaf, ids, distance + 8, hit >> 8);
    return 0u;
}

// The rays, one or two at a time, against all triangles of a leaf. Returns those that hit something, if any_hit is set.
static inline ulong rp_rays_hit_triangles(rp_stream* s, ulong rays, const __global rp_wide_leaf* leaf, const __global uchar* corners,
                                          const __global uint* ids, const bool any_hit) {
    const uint count = leaf->count;
    ulong hit = 0ul;
    if (count <= 8u && !rp_is_single(rays)) {
        const uint8 a = convert_uint8(vload8(0, corners)), b = convert_uint8(vload8(0, corners + count)),
                    c = convert_uint8(vload8(0, corners + 2u * count));
        const uint16 aa = (uint16)(a, a + 16u), bb = (uint16)(b, b + 16u), cc = (uint16)(c, c + 16u);
        do {
            const uint r = rp_lowest(rays);
            rays &= rays - 1ul;
            // The last one of an odd number is its own partner.
            const uint q = rays != 0ul ? rp_lowest(rays) : r;
            rays &= rays - 1ul;
            const uint both = rp_two_rays_hit_triangles(s, r, q, leaf, aa, bb, cc, ids, any_hit);
            if (any_hit) hit |= (ulong)(both & 1u) << r | (ulong)(both >> 1) << q;
        } while (rays != 0ul);
        return hit;
    }
    const uint16 a = convert_uint16(vload16(0, corners)), b = convert_uint16(vload16(0, corners + count));
    const uint16 c = convert_uint16(vload16(0, corners + 2u * count));
    do {
        const uint r = rp_lowest(rays);
        rays &= rays - 1ul;
        if (rp_ray_hits_triangles(s, r, leaf, a, b, c, ids, any_hit)) hit |= 1ul << r;
    } while (rays != 0ul);
    return hit;
}
#endif

// Sixteen rays along the same axis against one triangle after the other. Returns the lanes that hit something if any_hit is set.
static inline uint rp_packet_hits_triangles(rp_stream* s, uint p, uint lanes, const __global rp_wide_leaf* leaf, const __global uint* ids,
                                            const bool any_hit) {
    const uint axis = s->packet_axis[p], ix = rp_axis_x(axis), iy = rp_axis_y(axis), vertices = leaf->vertices, count = leaf->count;
    const __global float* at = rp_leaf_coordinates(leaf);
    const __global uchar* corners = rp_leaf_corners(leaf);
    const float16 ox = s->origin[ix][p], oy = s->origin[iy][p], oz = s->origin[axis][p];
    const float16 shear_x = s->shear[0][p], shear_y = s->shear[1][p];
    const rp_vector_16 inverse = {s->inverse[ix][p], s->inverse[iy][p], s->inverse[axis][p]};
    rp_vector_16 relative[RP_WIDE_LEAF_VERTICES];
    float16 x[RP_WIDE_LEAF_VERTICES], y[RP_WIDE_LEAF_VERTICES];
    for (uint v = 0u; v < vertices; v++) {
        const float16 rx = at[vertices * ix + v] - ox, ry = at[vertices * iy + v] - oy, rz = at[vertices * axis + v] - oz;
        relative[v].x = rx;
        relative[v].y = ry;
        relative[v].z = rz;
        x[v] = rx - shear_x * rz;
        y[v] = ry - shear_y * rz;
    }
    // First the sides of the edges of all triangles; then the distances of those that a ray passes through.
    rp_edges_16 edges[RP_WIDE_LEAF_TRIANGLES];
    uint inside_of[RP_WIDE_LEAF_TRIANGLES], candidates = 0u;
    for (uint k = 0u; k < count; k++) {
        const uint a = corners[k], b = corners[count + k], c = corners[2u * count + k];
        inside_of[k] = rp_inside_16(x[a], y[a], x[b], y[b], x[c], y[c], lanes, &edges[k]);
        candidates |= (inside_of[k] != 0u ? 1u : 0u) << k;
    }
#ifdef RP_CUTOUTS
    candidates &= RP_TESTED(s, leaf);
#endif
    uint hit_any = 0u;
    for (; candidates != 0u; candidates &= candidates - 1u) {
        const uint k = rp_lowest(candidates), lanes_inside = inside_of[k] & lanes;
        const uint a = corners[k], b = corners[count + k], c = corners[2u * count + k];
        float16 t;
        uint hit = rp_distance_16(&edges[k], &relative[a], &relative[b], &relative[c], inverse, lanes_inside, &t);
        t = RP_PACKET_IN_WORLD(s, p, t);
        const uint id = ids[k];
        if (any_hit) {
            hit &= rp_mask16(t <= s->t[p]);
            hit_any |= hit;
            lanes &= ~hit;
            if (lanes == 0u) break;
        } else {
#ifdef RP_INSTANCES
            const uint16 inside = (uint16)(s->instance_number);
            const int16 first = (inside < s->number[p]) | ((inside == s->number[p]) & ((uint16)(id) < s->primitive[p]));
#else
            const int16 first = (uint16)(id) < s->primitive[p];
#endif
            hit &= rp_mask16((t < s->t[p]) | ((t == s->t[p]) & first));
            if (hit == 0u) continue;
            const int16 better = rp_lanes16(hit);
            const ulong place = (ulong)leaf | k;
            s->t[p] = better ? t : s->t[p];
            s->primitive[p] = better ? (uint16)(id) : s->primitive[p];
            s->hit_low[p] = better ? (uint16)((uint)place) : s->hit_low[p];
            s->hit_high[p] = better ? (uint16)((uint)(place >> 32)) : s->hit_high[p];
#ifdef RP_INSTANCES
            s->number[p] = better ? inside : s->number[p];
            s->hit_instance_low[p] = better ? (uint16)((uint)s->instance) : s->hit_instance_low[p];
            s->hit_instance_high[p] = better ? (uint16)((uint)(s->instance >> 32)) : s->hit_instance_high[p];
#endif
        }
    }
    return hit_any;
}

// Rays that hit something, if any_hit is set.
static inline ulong rp_hit_triangles(rp_stream* s, ulong rays, const __global rp_wide_leaf* leaf, const bool any_hit) {
    const __global uchar* corners = rp_leaf_corners(leaf);
    const __global uint* ids = rp_leaf_ids(leaf);
    if (popcount(rays) < RP_DENSE_TRIANGLES) return rp_rays_hit_triangles(s, rays, leaf, corners, ids, any_hit);
    ulong alone = 0ul, hit = 0ul;
    for (uint p = 0u; p < RP_PACKETS; p++) {
        const uint lanes = rp_lanes_of(rays, p);
        if (popcount(lanes) < RP_DENSE_TRIANGLES || s->packet_axis[p] == RP_MIXED)
            alone |= (ulong)lanes << (RP_PACKET_RAYS * p);
        else
            hit |= (ulong)rp_packet_hits_triangles(s, p, lanes, leaf, ids, any_hit) << (RP_PACKET_RAYS * p);
    }
    return alone != 0ul ? hit | rp_rays_hit_triangles(s, alone, leaf, corners, ids, any_hit) : hit;
}

static inline rp_ray rp_ray_of_stream(const rp_stream* s, uint r) {
    return rp_make_ray((float3)(RP_OF_RAY(s->origin[0], r), RP_OF_RAY(s->origin[1], r), RP_OF_RAY(s->origin[2], r)),
                       (float3)(RP_OF_RAY(s->direction[0], r), RP_OF_RAY(s->direction[1], r), RP_OF_RAY(s->direction[2], r)));
}

// rp_sphere.
static inline const __global uint4* rp_leaf_spheres(const __global rp_wide_leaf* leaf) { return (const __global uint4*)(leaf + 2); }
static inline const __global uint* rp_leaf_sphere_ids(const __global rp_wide_leaf* leaf) {
    return (const __global uint*)(rp_leaf_spheres(leaf) + leaf->count);
}
static inline const __global uint* rp_ids_of_leaf(const __global rp_wide_leaf* leaf) {
    return leaf->kind == RP_WIDE_TRIANGLES ? rp_leaf_ids(leaf) : rp_leaf_sphere_ids(leaf);
}

static inline ulong rp_hit_spheres(rp_stream* s, ulong rays, const __global rp_wide_leaf* leaf, const bool any_hit) {
    const __global uint4* spheres = rp_leaf_spheres(leaf);
    const __global uint* ids = rp_leaf_sphere_ids(leaf);
    const uint kind = leaf->flags & RP_WIDE_POINTS ? RP_LEAF_POINTS : 0u;
    ulong hit = 0ul;
    do {
        const uint r = rp_lowest(rays);
        rays &= rays - 1ul;
        const rp_ray ray = rp_ray_of_stream(s, r);
        float distance[RP_WIDE_LEAF_SPHERES];
        uint hits = 0u;
        for (uint k = 0u; k < leaf->count; k++) {
            distance[k] = rp_hit_sphere(&ray, rp_decode_sphere(spheres[k], kind));
            if (!(distance[k] > 0.0f)) continue;
            distance[k] = RP_IN_WORLD(s, r, distance[k]);
            if (distance[k] <= RP_OF_RAY(s->t, r)) hits |= 1u << k;
        }
#ifdef RP_CUTOUTS
        hits &= RP_TESTED(s, leaf);
#endif
        if (hits == 0u) continue;
        if (any_hit)
            hit |= 1ul << r;
        else
            rp_keep_closest(s, r, leaf, ids, distance, hits);
    } while (rays != 0ul);
    return hit;
}

#endif
