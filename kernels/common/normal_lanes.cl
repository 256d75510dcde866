// Octahedral unit vectors in 2 x 16 bits (Cigolle et al. 2014, "A Survey of Efficient Representations for Independent Unit Vectors"), on RP_LANES
// lanes. May be included more than once for a number of lanes: with AVX-512 surfaces and shading both have sixteen.
#if (RP_LANES == 1 && !defined(RP_HAS_NORMALS_1)) || (RP_LANES == 8 && !defined(RP_HAS_NORMALS_8)) || (RP_LANES == 16 && !defined(RP_HAS_NORMALS_16))
#if RP_LANES == 1
#define RP_HAS_NORMALS_1
#elif RP_LANES == 8
#define RP_HAS_NORMALS_8
#else
#define RP_HAS_NORMALS_16
#endif
#include "common/begin_lanes.cl"
#include "common/vector_lanes.cl"

// Of any length but 0.
static inline RP_UINTS RP_NAME(rp_encode_normal_)(RP_NAME(rp_vector_) n) {
    const RP_FLOATS scale = rp_div(1.0f, fabs(n.x) + fabs(n.y) + fabs(n.z));
    const RP_FLOATS u = n.x * scale, v = n.y * scale;
    const RP_FLOATS x = n.z < 0.0f ? copysign(1.0f - fabs(v), u) : u, y = n.z < 0.0f ? copysign(1.0f - fabs(u), v) : v;
    const RP_UINTS i = RP_AS_UINTS(RP_TO_NEAREST_INTS(rp_min(rp_max(x, -1.0f), 1.0f) * 32767.0f));
    const RP_UINTS j = RP_AS_UINTS(RP_TO_NEAREST_INTS(rp_min(rp_max(y, -1.0f), 1.0f) * 32767.0f));
    return (i & 0xffffu) | j << 16;
}

// The point of the octahedron that a code stands for: a vector along the normal, the magnitudes of whose coordinates add up to 1.
static inline RP_NAME(rp_vector_) RP_NAME(rp_octahedron_point_)(RP_UINTS code) {
    const RP_FLOATS u = RP_TO_FLOATS(RP_AS_INTS(code << 16u) >> 16) * (1.0f / 32767.0f), v = RP_TO_FLOATS(RP_AS_INTS(code) >> 16) * (1.0f / 32767.0f);
    const RP_FLOATS z = 1.0f - fabs(u) - fabs(v);
    const RP_NAME(rp_vector_) p = {z < 0.0f ? copysign(1.0f - fabs(v), u) : u, z < 0.0f ? copysign(1.0f - fabs(u), v) : v, z};
    return p;
}

static inline RP_NAME(rp_vector_) RP_NAME(rp_decode_normal_)(RP_UINTS code) {
    const RP_NAME(rp_vector_) p = RP_NAME(rp_octahedron_point_)(code);
    return RP_NAME(rp_times_)(p, rp_rsqrt(RP_NAME(rp_dot_)(p, p)));
}

#include "common/end_lanes.cl"
#endif
