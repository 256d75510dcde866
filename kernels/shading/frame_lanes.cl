// Shading frames, on RP_LANES lanes. Included once for each number of lanes.
#include "common/begin_lanes.cl"
#include "common/vector_lanes.cl"

// A shading frame on the side of the surface that the ray came from.
typedef struct RP_NAME(rp_frame_) {
    RP_NAME(rp_vector_) normal;  // shading normal, towards the viewer
    RP_NAME(rp_vector_) tangent, bitangent;
    RP_NAME(rp_vector_) geometric_normal;  // towards the viewer
    RP_NAME(rp_vector_) view;              // unit, towards the viewer
    RP_INTS back_facing;                   // the viewer is on the side that the surface's own normal points away from
} RP_NAME(rp_frame_);

static inline RP_NAME(rp_vector_) RP_NAME(rp_facing_)(RP_INTS turn, RP_NAME(rp_vector_) v) {
    const RP_NAME(rp_vector_) r = {turn ? -v.x : v.x, turn ? -v.y : v.y, turn ? -v.z : v.z};
    return r;
}

// direction: of the ray that came, unit; normals: octahedral.
static inline RP_NAME(rp_frame_) RP_NAME(rp_make_frame_)(RP_NAME(rp_vector_) direction, RP_UINTS geometric_normal, RP_UINTS shading_normal) {
    RP_NAME(rp_frame_) f;
    const RP_NAME(rp_vector_) geometric = RP_NAME(rp_decode_normal_)(geometric_normal);
    const RP_NAME(rp_vector_) shading = RP_NAME(rp_decode_normal_)(shading_normal);
    f.view = RP_NAME(rp_times_)(direction, (RP_FLOATS)(-1.0f));
    f.back_facing = RP_NAME(rp_dot_)(geometric, direction) > 0.0f;
    f.geometric_normal = RP_NAME(rp_facing_)(f.back_facing, geometric);
    f.normal = RP_NAME(rp_facing_)(RP_NAME(rp_dot_)(shading, f.geometric_normal) < 0.0f, shading);
    // Where interpolation turned the normal away from the viewer, the geometric one serves.
    f.normal = RP_NAME(rp_choose_)(RP_NAME(rp_dot_)(f.normal, f.view) <= 0.0f, f.geometric_normal, f.normal);
    // Duff et al. 2017, "Building an Orthonormal Basis, Revisited".
    const RP_NAME(rp_vector_) n = f.normal;
    const RP_FLOATS sign = copysign((RP_FLOATS)(1.0f), n.z), a = -1.0f / (sign + n.z), b = n.x * n.y * a;
    f.tangent.x = 1.0f + sign * n.x * n.x * a;
    f.tangent.y = sign * b;
    f.tangent.z = -sign * n.x;
    f.bitangent.x = b;
    f.bitangent.y = sign + n.y * n.y * a;
    f.bitangent.z = -n.y;
    return f;
}

static inline RP_NAME(rp_vector_) RP_NAME(rp_to_world_)(const RP_NAME(rp_frame_)* f, RP_NAME(rp_vector_) v) {
    return RP_NAME(rp_plus_)(RP_NAME(rp_plus_)(RP_NAME(rp_times_)(f->tangent, v.x), RP_NAME(rp_times_)(f->bitangent, v.y)),
                             RP_NAME(rp_times_)(f->normal, v.z));
}

#include "common/end_lanes.cl"
