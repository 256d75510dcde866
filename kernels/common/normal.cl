// Normals in 32 bits (normal_lanes.cl), one at a time.
#ifndef RP_NORMAL_CL
#define RP_NORMAL_CL

#include "common/arithmetic.cl"

#define RP_LANES 1
#include "common/normal_lanes.cl"
#undef RP_LANES

static inline uint rp_encode_normal(float3 n) { return rp_encode_normal_1(rp_vector_of(n)); }
// Not rp_decode_normal_1, in which a compiler may fuse operations: of a surface, it must be the same in every kernel (shading/surface.cl).
static inline float3 rp_decode_normal(uint code) { return rp_normalize(rp_float3(rp_octahedron_point_1(code))); }

#endif
