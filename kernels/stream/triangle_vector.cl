// The triangle test of primitive.cl on RP_LANES lanes, operation by operation the same, so that the results are the same to the bit. (Only the
// first two axes may be the other way round, which turns the signs of all edge functions and of their sums round.)
// Included once for each number of lanes: one ray against eight triangles, or sixteen rays against one.
#include "common/begin_lanes.cl"

static inline RP_FLOATS RP_NAME(rp_sum3_)(RP_FLOATS a, RP_FLOATS b, RP_FLOATS c) {
    const RP_FLOATS high = rp_max(rp_max(a, b), c), low = rp_min(rp_min(a, b), c);
    const RP_FLOATS middle = rp_max(rp_min(a, b), rp_min(rp_max(a, b), c));
    return (high + low) + middle;
}

static inline RP_FLOATS RP_NAME(rp_edge_remainder_)(RP_FLOATS a, RP_FLOATS b, RP_FLOATS c, RP_FLOATS d) {
    const RP_FLOATS ab = a * b, cd = c * d;
    return fma(a, b, -ab) - fma(c, d, -cd);
}

static inline RP_INTS RP_NAME(rp_signs_differ_)(RP_FLOATS u, RP_FLOATS v, RP_FLOATS w) {
    return (rp_min(rp_min(u, v), w) < 0.0f) & (rp_max(rp_max(u, v), w) > 0.0f);
}

typedef struct RP_NAME(rp_edges_) {
    RP_FLOATS u, v, w;
} RP_NAME(rp_edges_);

// First half: on which side of the edges the ray passes. Lanes in which the triangle is missed are clear in the result; if all
// are, edges may be left as they were.
static inline uint RP_NAME(rp_inside_)(RP_FLOATS ax, RP_FLOATS ay, RP_FLOATS bx, RP_FLOATS by, RP_FLOATS cx, RP_FLOATS cy, uint lanes,
                                       RP_NAME(rp_edges_)* edges) {
    RP_FLOATS u = cx * by - cy * bx, v = ax * cy - ay * cx, w = bx * ay - by * ax;
    uint inside = lanes & ~RP_NAME(rp_mask)(RP_NAME(rp_signs_differ_)(u, v, w));
    if (inside == 0u) return 0u;
    if (inside & RP_NAME(rp_mask)((u == 0.0f) | (v == 0.0f) | (w == 0.0f))) {
        u = u == 0.0f ? RP_NAME(rp_edge_remainder_)(cx, by, cy, bx) : u;
        v = v == 0.0f ? RP_NAME(rp_edge_remainder_)(ax, cy, ay, cx) : v;
        w = w == 0.0f ? RP_NAME(rp_edge_remainder_)(bx, ay, by, ax) : w;
        inside &= ~RP_NAME(rp_mask)(RP_NAME(rp_signs_differ_)(u, v, w));
    }
    edges->u = u;
    edges->v = v;
    edges->w = w;
    return inside;
}

// Vertices relative to the ray's origin, in Woop's order of axes.
typedef struct RP_NAME(rp_points_) {
    RP_FLOATS x, y, z;
} RP_NAME(rp_points_);

static inline void RP_NAME(rp_clip_)(RP_FLOATS low, RP_FLOATS high, RP_FLOATS reciprocal, RP_FLOATS* entry, RP_FLOATS* leave) {
    const RP_FLOATS a = low * reciprocal, b = high * reciprocal;
    *entry = rp_max(*entry, rp_min(a, b));
    *leave = rp_min(*leave, rp_max(a, b));
}

// Second half: the distances. Lanes without a hit in front of the ray are clear in the result.
static inline uint RP_NAME(rp_distance_)(const RP_NAME(rp_edges_)* edges, const RP_NAME(rp_points_)* a, const RP_NAME(rp_points_)* b,
                                         const RP_NAME(rp_points_)* c, RP_FLOATS shear_z, RP_FLOATS inverse_x, RP_FLOATS inverse_y,
                                         RP_FLOATS inverse_z, uint inside, RP_FLOATS* distance) {
    const RP_FLOATS determinant = RP_NAME(rp_sum3_)(edges->u, edges->v, edges->w);
    const RP_FLOATS az = a->z * shear_z, bz = b->z * shear_z, cz = c->z * shear_z;
    const RP_FLOATS t = RP_NAME(rp_sum3_)(edges->u * az, edges->v * bz, edges->w * cz) / determinant;
    // In the triangle's own bounds: rp_in_bounds.
    RP_FLOATS entry = (RP_FLOATS)(-INFINITY), leave = (RP_FLOATS)(INFINITY);
    RP_NAME(rp_clip_)(rp_min(rp_min(a->x, b->x), c->x), rp_max(rp_max(a->x, b->x), c->x), inverse_x, &entry, &leave);
    RP_NAME(rp_clip_)(rp_min(rp_min(a->y, b->y), c->y), rp_max(rp_max(a->y, b->y), c->y), inverse_y, &entry, &leave);
    RP_NAME(rp_clip_)(rp_min(rp_min(a->z, b->z), c->z), rp_max(rp_max(a->z, b->z), c->z), inverse_z, &entry, &leave);
    const RP_FLOATS moved = rp_min(rp_max(t, rp_min(entry, leave)), rp_max(entry, leave));
    *distance = moved;
    return inside & RP_NAME(rp_mask)((determinant != 0.0f) & (t == t) & (leave > 0.0f) & (moved > 0.0f));
}

#include "common/end_lanes.cl"
