// Surfaces of triangles at hits, on RP_LANES lanes; 1: scalars. Included once for each number of lanes, so that one ray and eight or sixteen
// get the same results to the bit: nothing here but operations that every number of lanes does alike.
#include "common/begin_lanes.cl"
#include "common/vector_lanes.cl"

// The axis along which the ray travels farthest last, the others in cyclic order.
static inline RP_NAME(rp_vector_) RP_NAME(rp_permute_)(RP_INTS axis, RP_NAME(rp_vector_) v) {
    RP_NAME(rp_vector_) r;
    r.x = axis == 2 ? v.x : (axis == 0 ? v.y : v.z);
    r.y = axis == 2 ? v.y : (axis == 0 ? v.z : v.x);
    r.z = axis == 2 ? v.z : (axis == 0 ? v.x : v.y);
    return r;
}

// Position order, for rp_triangle_point_.
static inline RP_INTS RP_NAME(rp_comes_before_)(RP_NAME(rp_vector_) a, RP_NAME(rp_vector_) b) {
    return (a.x < b.x) | ((a.x == b.x) & ((a.y < b.y) | ((a.y == b.y) & (a.z < b.z))));
}

typedef struct RP_NAME(rp_triangle_point_) {
    RP_NAME(rp_vector_) position;
    RP_FLOATS b, c;                    // weights of the second and third corner, counted from the first by position
    RP_INTS turns;                     // how far that one is from the first by number
    RP_UINTS normal, offset_exponent;  // see rp_surface
} RP_NAME(rp_triangle_point_);

// Where the ray meets the triangle.
static inline RP_NAME(rp_triangle_point_) RP_NAME(rp_point_on_triangle_)(RP_NAME(rp_vector_) origin, RP_NAME(rp_vector_) direction,
                                                                         RP_NAME(rp_vector_) a, RP_NAME(rp_vector_) b, RP_NAME(rp_vector_) c) {
    RP_NAME(rp_triangle_point_) p;
    // Begin with the first corner by position, so that the arithmetic below does not depend on how the leaf lists them.
    p.turns = (RP_INTS)(0);
    for (int turn = 0; turn < 2; turn++) {
        const RP_INTS before = RP_NAME(rp_comes_before_)(b, a) | RP_NAME(rp_comes_before_)(c, a);
        const RP_NAME(rp_vector_) first = a;
        a = RP_NAME(rp_choose_)(before, b, a);
        b = RP_NAME(rp_choose_)(before, c, b);
        c = RP_NAME(rp_choose_)(before, first, c);
        p.turns += before & 1;
    }
    const RP_FLOATS mx = fabs(direction.x), my = fabs(direction.y), mz = fabs(direction.z);
    const RP_INTS axis = mx >= rp_max(my, mz) ? (RP_INTS)(0) : my >= mz ? (RP_INTS)(1) : (RP_INTS)(2);
    const RP_NAME(rp_vector_) along = RP_NAME(rp_permute_)(axis, direction);
    const RP_FLOATS shear_z = 1.0f / along.z, shear_x = along.x * shear_z, shear_y = along.y * shear_z;
    const RP_NAME(rp_vector_) ra = RP_NAME(rp_permute_)(axis, RP_NAME(rp_minus_)(a, origin)),
                              rb = RP_NAME(rp_permute_)(axis, RP_NAME(rp_minus_)(b, origin));
    const RP_NAME(rp_vector_) rc = RP_NAME(rp_permute_)(axis, RP_NAME(rp_minus_)(c, origin));
    const RP_FLOATS ax = ra.x - shear_x * ra.z, ay = ra.y - shear_y * ra.z;
    const RP_FLOATS bx = rb.x - shear_x * rb.z, by = rb.y - shear_y * rb.z;
    const RP_FLOATS cx = rc.x - shear_x * rc.z, cy = rc.y - shear_y * rc.z;
    const RP_FLOATS u = cx * by - cy * bx, v = ax * cy - ay * cx;
    const RP_FLOATS w = bx * ay - by * ax, total = u + v + w;
    p.b = v / total;
    p.c = w / total;
    const RP_NAME(rp_vector_) e1 = RP_NAME(rp_minus_)(b, a), e2 = RP_NAME(rp_minus_)(c, a);
    p.position.x = a.x + (p.b * e1.x + p.c * e2.x);
    p.position.y = a.y + (p.b * e1.y + p.c * e2.y);
    p.position.z = a.z + (p.b * e1.z + p.c * e2.z);
    p.normal = RP_NAME(rp_encode_normal_)(RP_NAME(rp_cross_)(RP_NAME(rp_unit_vector_)(e1), RP_NAME(rp_unit_vector_)(e2)));
    const RP_FLOATS largest = rp_max(rp_max(RP_NAME(rp_largest_)(a), RP_NAME(rp_largest_)(b)), RP_NAME(rp_largest_)(c));
    // Rounding moves a point that is an affine combination of vertices by a few units in the last place of the largest of them; 2^-20
    // of it, rounded up to a power of two, is 8 to 16 of these.
    p.offset_exponent = (RP_AS_UINTS(largest) >> 23 & 255u) + (150u - 127u - 19u);
    return p;
}

#include "common/end_lanes.cl"
