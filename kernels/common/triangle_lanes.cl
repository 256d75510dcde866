// The test of a triangle (primitive.cl) on RP_LANES lanes: one ray against one triangle, or against eight; sixteen rays against one triangle.
// Included once for each number of lanes.
#include "common/begin_lanes.cl"
#include "common/vector_lanes.cl"

// The sum of three numbers, independent of their order, and with exactly the opposite sign if all signs are reversed.
static inline RP_FLOATS RP_NAME(rp_sum3_)(RP_FLOATS a, RP_FLOATS b, RP_FLOATS c) {
    const RP_FLOATS high = rp_max(rp_max(a, b), c), low = rp_min(rp_min(a, b), c);
    const RP_FLOATS middle = rp_max(rp_min(a, b), rp_min(rp_max(a, b), c));
    return RP_ADD(RP_ADD(high, low), middle);
}

// a * b - c * d, the area on one side of an edge: 0, or of the right sign.
static inline RP_FLOATS RP_NAME(rp_edge_function_)(RP_FLOATS a, RP_FLOATS b, RP_FLOATS c, RP_FLOATS d) { return RP_MUL(a, b) - RP_MUL(c, d); }
// What rounding took from it: from its products, which is exact but for one rounding (Dekker 1971; fma gives the rounding error of a product).
static inline RP_FLOATS RP_NAME(rp_edge_remainder_)(RP_FLOATS a, RP_FLOATS b, RP_FLOATS c, RP_FLOATS d) {
    const RP_FLOATS ab = RP_MUL(a, b), cd = RP_MUL(c, d);
    return fma(a, b, -ab) - fma(c, d, -cd);
}

// Whether one of them is below 0 and one above.
#if RP_LANES == 1
// Looked up in their bits: those of numbers below 0 are above those of -0, as unsigned integers. GPUs take the greatest of three integers in one
// instruction, and CPUs that of eight floats.
static inline int rp_signs_differ_1(float u, float v, float w) {
    return max(max(as_uint(u), as_uint(v)), as_uint(w)) > 0x80000000u && max(max(as_int(u), as_int(v)), as_int(w)) > 0;
}
#else
static inline RP_INTS RP_NAME(rp_signs_differ_)(RP_FLOATS u, RP_FLOATS v, RP_FLOATS w) {
    return (rp_min(rp_min(u, v), w) < 0.0f) & (rp_max(rp_max(u, v), w) > 0.0f);
}
#endif

typedef struct RP_NAME(rp_edges_) {
    RP_FLOATS u, v, w;
} RP_NAME(rp_edges_);

static inline RP_NAME(rp_edges_) RP_NAME(rp_edge_functions_)(RP_FLOATS ax, RP_FLOATS ay, RP_FLOATS bx, RP_FLOATS by, RP_FLOATS cx, RP_FLOATS cy) {
    const RP_NAME(rp_edges_) edges = {RP_NAME(rp_edge_function_)(cx, by, cy, bx), RP_NAME(rp_edge_function_)(ax, cy, ay, cx),
                                      RP_NAME(rp_edge_function_)(bx, ay, by, ax)};
    return edges;
}

// First half: on which side of the edges the ray passes. Edges and vertices belong to all triangles that share them. ax to cy: vertices as the ray
// sees them, sheared. Lanes in which the triangle is missed are clear in the result; if all are, edges may be left as they were. Else these are areas
// to the last bits: on a triangle that is a thousand times as long as wide, those above are wrong by a thousand times as much, and so would be the
// distance, by which rays that leave such a triangle would hit it again.
static inline uint RP_NAME(rp_inside_)(RP_FLOATS ax, RP_FLOATS ay, RP_FLOATS bx, RP_FLOATS by, RP_FLOATS cx, RP_FLOATS cy, uint lanes,
                                       RP_NAME(rp_edges_)* edges) {
    const RP_NAME(rp_edges_) e = RP_NAME(rp_edge_functions_)(ax, ay, bx, by, cx, cy);
    uint inside = lanes & ~RP_MASK(RP_NAME(rp_signs_differ_)(e.u, e.v, e.w));
    if (inside == 0u) return 0u;
    const RP_FLOATS u = RP_ADD(e.u, RP_NAME(rp_edge_remainder_)(cx, by, cy, bx)), v = RP_ADD(e.v, RP_NAME(rp_edge_remainder_)(ax, cy, ay, cx)),
                    w = RP_ADD(e.w, RP_NAME(rp_edge_remainder_)(bx, ay, by, ax));
    // Rounding is monotone, so an edge function never has the wrong sign, but it may have come out as 0 and passed for an edge.
    if (inside & RP_MASK((e.u == 0.0f) | (e.v == 0.0f) | (e.w == 0.0f)))
        inside &= ~RP_MASK(RP_NAME(rp_signs_differ_)(e.u == 0.0f ? u : e.u, e.v == 0.0f ? v : e.v, e.w == 0.0f ? w : e.w));
    edges->u = u;
    edges->v = v;
    edges->w = w;
    return inside;
}

// The distance of a hit on a primitive with the bounds [low, high] (relative to the ray's origin), and whether it is one by them. t is wrong by
// rounding. It is moved to where the ray is within the bounds: or boxes around them would decide, by the order of visits, what is hit, and rays would
// pass through faces that they begin before. Bounds that end behind the origin are not hit at all, which boxes around them may have seen or not.
static inline RP_INTS RP_NAME(rp_in_bounds_)(RP_FLOATS t, RP_NAME(rp_vector_) low, RP_NAME(rp_vector_) high, RP_NAME(rp_vector_) reciprocal,
                                             RP_FLOATS* distance) {
    const RP_NAME(rp_vector_) a = RP_NAME(rp_product_)(low, reciprocal), b = RP_NAME(rp_product_)(high, reciprocal);
    const RP_FLOATS entry = rp_max(rp_max(rp_min(a.x, b.x), rp_min(a.y, b.y)), rp_min(a.z, b.z));
    const RP_FLOATS leave = rp_min(rp_min(rp_max(a.x, b.x), rp_max(a.y, b.y)), rp_max(a.z, b.z));
    // By rounding a ray may miss the bounds of what it hits: then they end before they begin.
    const RP_FLOATS moved = rp_min(rp_max(t, rp_min(entry, leave)), rp_max(entry, leave));
    *distance = moved;
    return (leave > 0.0f) & (moved > 0.0f) & (t == t);
}

static inline RP_NAME(rp_vector_) RP_NAME(rp_least_)(RP_NAME(rp_vector_) a, RP_NAME(rp_vector_) b) {
    const RP_NAME(rp_vector_) r = {rp_min(a.x, b.x), rp_min(a.y, b.y), rp_min(a.z, b.z)};
    return r;
}
static inline RP_NAME(rp_vector_) RP_NAME(rp_greatest_)(RP_NAME(rp_vector_) a, RP_NAME(rp_vector_) b) {
    const RP_NAME(rp_vector_) r = {rp_max(a.x, b.x), rp_max(a.y, b.y), rp_max(a.z, b.z)};
    return r;
}

// Second half: the distances. a, b, c: vertices relative to the ray's origin, in Woop's order of axes, as the reciprocals of its direction.
// Lanes without a hit in front of the ray are clear in the result.
static inline uint RP_NAME(rp_distance_)(const RP_NAME(rp_edges_)* edges, const RP_NAME(rp_vector_)* a, const RP_NAME(rp_vector_)* b,
                                         const RP_NAME(rp_vector_)* c, RP_NAME(rp_vector_) reciprocal, uint inside, RP_FLOATS* distance) {
    const RP_FLOATS determinant = RP_NAME(rp_sum3_)(edges->u, edges->v, edges->w);
    const RP_FLOATS az = RP_MUL(a->z, reciprocal.z), bz = RP_MUL(b->z, reciprocal.z), cz = RP_MUL(c->z, reciprocal.z);
    const RP_FLOATS t = RP_NAME(rp_sum3_)(RP_MUL(edges->u, az), RP_MUL(edges->v, bz), RP_MUL(edges->w, cz)) / determinant;
    const RP_NAME(rp_vector_) low = RP_NAME(rp_least_)(RP_NAME(rp_least_)(*a, *b), *c),
                              high = RP_NAME(rp_greatest_)(RP_NAME(rp_greatest_)(*a, *b), *c);
    return inside & RP_MASK((determinant != 0.0f) & RP_NAME(rp_in_bounds_)(t, low, high, reciprocal, distance));
}

#include "common/end_lanes.cl"
