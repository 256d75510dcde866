// Vectors of three coordinates on RP_LANES lanes; between begin_lanes.cl and end_lanes.cl, as often as one likes.
#if (RP_LANES == 1 && !defined(RP_HAS_VECTORS_1)) || (RP_LANES == 8 && !defined(RP_HAS_VECTORS_8)) || (RP_LANES == 16 && !defined(RP_HAS_VECTORS_16))
#if RP_LANES == 1
#define RP_HAS_VECTORS_1
#elif RP_LANES == 8
#define RP_HAS_VECTORS_8
#else
#define RP_HAS_VECTORS_16
#endif

typedef struct RP_NAME(rp_vector_) {
    RP_FLOATS x, y, z;
} RP_NAME(rp_vector_);

#if RP_LANES == 1
static inline rp_vector_1 rp_vector_of(float3 v) {
    const rp_vector_1 r = {v.x, v.y, v.z};
    return r;
}
static inline float3 rp_float3(rp_vector_1 v) { return (float3)(v.x, v.y, v.z); }
#endif

static inline RP_NAME(rp_vector_) RP_NAME(rp_plus_)(RP_NAME(rp_vector_) a, RP_NAME(rp_vector_) b) {
    const RP_NAME(rp_vector_) r = {a.x + b.x, a.y + b.y, a.z + b.z};
    return r;
}
static inline RP_NAME(rp_vector_) RP_NAME(rp_minus_)(RP_NAME(rp_vector_) a, RP_NAME(rp_vector_) b) {
    const RP_NAME(rp_vector_) r = {a.x - b.x, a.y - b.y, a.z - b.z};
    return r;
}
static inline RP_NAME(rp_vector_) RP_NAME(rp_times_)(RP_NAME(rp_vector_) v, RP_FLOATS factor) {
    const RP_NAME(rp_vector_) r = {v.x * factor, v.y * factor, v.z * factor};
    return r;
}
// Channel by channel.
static inline RP_NAME(rp_vector_) RP_NAME(rp_product_)(RP_NAME(rp_vector_) a, RP_NAME(rp_vector_) b) {
    const RP_NAME(rp_vector_) r = {a.x * b.x, a.y * b.y, a.z * b.z};
    return r;
}
static inline RP_FLOATS RP_NAME(rp_dot_)(RP_NAME(rp_vector_) a, RP_NAME(rp_vector_) b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

static inline RP_NAME(rp_vector_) RP_NAME(rp_choose_)(RP_INTS condition, RP_NAME(rp_vector_) yes, RP_NAME(rp_vector_) no) {
    const RP_NAME(rp_vector_) r = {condition ? yes.x : no.x, condition ? yes.y : no.y, condition ? yes.z : no.z};
    return r;
}

static inline RP_FLOATS RP_NAME(rp_largest_)(RP_NAME(rp_vector_) v) { return rp_max(rp_max(fabs(v.x), fabs(v.y)), fabs(v.z)); }

// Of length 1. Scaled by a power of two first, so that squares of very short or long vectors stay in range.
static inline RP_NAME(rp_vector_) RP_NAME(rp_unit_vector_)(RP_NAME(rp_vector_) v) {
    const RP_UINTS exponent = RP_AS_UINTS(RP_NAME(rp_largest_)(v)) & 0x7f800000u;
    const RP_FLOATS scale = RP_AS_FLOATS(0x7f000000u - exponent);
    const RP_FLOATS x = v.x * scale, y = v.y * scale, z = v.z * scale, inverse = rp_rsqrt(x * x + y * y + z * z);
    const RP_NAME(rp_vector_) r = {x * inverse, y * inverse, z * inverse};
    return r;
}

static inline RP_NAME(rp_vector_) RP_NAME(rp_cross_)(RP_NAME(rp_vector_) a, RP_NAME(rp_vector_) b) {
    const RP_NAME(rp_vector_) r = {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
    return r;
}

#endif
