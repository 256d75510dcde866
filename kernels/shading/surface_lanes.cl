// Surfaces of triangles at hits, on RP_LANES lanes; 1: scalars. Included once for each number of lanes, after triangle_lanes.cl, so that one ray and
// eight or sixteen get the same results to the bit: nothing here but operations that every number of lanes does alike. None is fused, so that it
// makes no difference which kernel a compiler has put these into: on some devices the surface at a hit is found by the stage `shade`, or, if the ray
// has to wait then, by `extend`.
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

// Rounding moves a point that is an affine combination of vertices by a few units in the last place of the largest of them; 2^-20 of it,
// rounded up to a power of two, is 8 to 16 of these.
static inline RP_UINTS RP_NAME(rp_offset_exponent_)(RP_FLOATS largest_coordinate) {
    return (RP_AS_UINTS(largest_coordinate) >> 23 & 255u) + (150u - 127u - 19u);
}

// rp_unit_vector_, with nothing fused.
static inline RP_NAME(rp_vector_) RP_NAME(rp_edge_direction_)(RP_NAME(rp_vector_) v) {
    const RP_UINTS exponent = RP_AS_UINTS(RP_NAME(rp_largest_)(v)) & 0x7f800000u;
    const RP_FLOATS scale = RP_AS_FLOATS(0x7f000000u - exponent);
    const RP_FLOATS x = RP_MUL(v.x, scale), y = RP_MUL(v.y, scale), z = RP_MUL(v.z, scale);
    const RP_FLOATS inverse = rp_div(1.0f, rp_sqrt(RP_ADD(RP_ADD(RP_MUL(x, x), RP_MUL(y, y)), RP_MUL(z, z))));
    const RP_NAME(rp_vector_) r = {RP_MUL(x, inverse), RP_MUL(y, inverse), RP_MUL(z, inverse)};
    return r;
}

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
    const RP_FLOATS shear_z = rp_div(1.0f, along.z), shear_x = RP_MUL(along.x, shear_z), shear_y = RP_MUL(along.y, shear_z);
    const RP_NAME(rp_vector_) ra = RP_NAME(rp_permute_)(axis, RP_NAME(rp_minus_)(a, origin)),
                              rb = RP_NAME(rp_permute_)(axis, RP_NAME(rp_minus_)(b, origin));
    const RP_NAME(rp_vector_) rc = RP_NAME(rp_permute_)(axis, RP_NAME(rp_minus_)(c, origin));
    const RP_NAME(rp_edges_) edges =
        RP_NAME(rp_edge_functions_)(ra.x - RP_MUL(shear_x, ra.z), ra.y - RP_MUL(shear_y, ra.z), rb.x - RP_MUL(shear_x, rb.z),
                                    rb.y - RP_MUL(shear_y, rb.z), rc.x - RP_MUL(shear_x, rc.z), rc.y - RP_MUL(shear_y, rc.z));
    const RP_FLOATS total = edges.u + edges.v + edges.w;
    p.b = rp_div(edges.v, total);
    p.c = rp_div(edges.w, total);
    const RP_NAME(rp_vector_) e1 = RP_NAME(rp_minus_)(b, a), e2 = RP_NAME(rp_minus_)(c, a);
    p.position.x = RP_ADD(a.x, RP_ADD(RP_MUL(p.b, e1.x), RP_MUL(p.c, e2.x)));
    p.position.y = RP_ADD(a.y, RP_ADD(RP_MUL(p.b, e1.y), RP_MUL(p.c, e2.y)));
    p.position.z = RP_ADD(a.z, RP_ADD(RP_MUL(p.b, e1.z), RP_MUL(p.c, e2.z)));
    const RP_NAME(rp_vector_) d1 = RP_NAME(rp_edge_direction_)(e1), d2 = RP_NAME(rp_edge_direction_)(e2);
    const RP_NAME(rp_vector_) normal = {RP_NAME(rp_edge_function_)(d1.y, d2.z, d1.z, d2.y), RP_NAME(rp_edge_function_)(d1.z, d2.x, d1.x, d2.z),
                                        RP_NAME(rp_edge_function_)(d1.x, d2.y, d1.y, d2.x)};
    p.normal = RP_NAME(rp_encode_normal_)(normal);
    const RP_FLOATS largest = rp_max(rp_max(RP_NAME(rp_largest_)(a), RP_NAME(rp_largest_)(b)), RP_NAME(rp_largest_)(c));
    p.offset_exponent = RP_NAME(rp_offset_exponent_)(largest);
    return p;
}

#include "common/end_lanes.cl"
