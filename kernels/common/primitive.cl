// Rays against triangles and spheres: exact positions, one test for every device and traversal.
//
// Triangles: Woop, Benthin, Wald 2013, "Watertight Ray/Triangle Intersection", in single precision with unfused products, so that two
// triangles see their shared edge with exactly opposite signs and no ray slips between. On top of that the result does not depend on the
// order in which a strip lists the three vertices (rp_sum3_), so that it is the same however the scene was cut into blocks.
#ifndef RP_PRIMITIVE_CL
#define RP_PRIMITIVE_CL

#include "common/box.cl"

#define RP_LANES 1
#include "common/triangle_lanes.cl"
#undef RP_LANES

// Woop's transform: the axis along which the ray travels farthest becomes z, and the other two are sheared so that the ray runs along it.
typedef struct rp_shear {
    uint axis;   // which axis became z: 0 (z), RP_AXIS_X or RP_AXIS_Y; the bits below mean nothing here
    float x, y;  // shear constants d.x / d.z, d.y / d.z (permuted); the third, 1 / d.z, is one of the ray's reciprocals
} rp_shear;
// Each is told from the others by one comparison of signed numbers.
#define RP_AXIS_X 0x40000000u
#define RP_AXIS_Y 0x80000000u

// Which of the other two comes first turns the signs of all edge functions round, and nothing else.
static inline float3 rp_permute(uint axis, float3 v) {
    const bool is_x = as_int(axis) >= (int)RP_AXIS_X, is_y = as_int(axis) < 0;
    return (float3)(is_x ? v.z : v.x, is_y ? v.z : v.y, is_x ? v.x : is_y ? v.y : v.z);
}

static inline rp_shear rp_make_shear(const rp_ray* ray) {
    const float3 magnitude = fabs(ray->direction);
    rp_shear s;
    s.axis = magnitude.x >= magnitude.y && magnitude.x >= magnitude.z ? RP_AXIS_X : magnitude.y >= magnitude.z ? RP_AXIS_Y : 0u;
    const float3 d = rp_permute(s.axis, ray->direction);
    const float z = rp_permute(s.axis, ray->reciprocal).z;
    s.x = rp_mul(d.x, z);
    s.y = rp_mul(d.y, z);
    return s;
}

// A vertex as the test needs it: relative to the ray's origin, and sheared.
typedef struct rp_sheared {
    float3 relative;
    float x, y;
} rp_sheared;

static inline rp_sheared rp_shear_vertex(const rp_ray* ray, const rp_shear* s, float3 position) {
    rp_sheared v;
    v.relative = rp_permute(s->axis, position - ray->origin);
    v.x = v.relative.x - rp_mul(s->x, v.relative.z);
    v.y = v.relative.y - rp_mul(s->y, v.relative.z);
    return v;
}

// Whether the ray's line may hit a triangle: false only where the test below says so by signs.
static inline bool rp_may_hit_triangle(const rp_sheared* a, const rp_sheared* b, const rp_sheared* c) {
    const rp_edges_1 e = rp_edge_functions_1(a->x, a->y, b->x, b->y, c->x, c->y);
    return !rp_signs_differ_1(e.u, e.v, e.w);
}

// Distance of the hit, or -1.
static inline float rp_hit_triangle(const rp_ray* ray, const rp_shear* s, const rp_sheared* a, const rp_sheared* b, const rp_sheared* c) {
    rp_edges_1 edges;
    if (rp_inside_1(a->x, a->y, b->x, b->y, c->x, c->y, 1u, &edges) == 0u) return -1.0f;
    const rp_vector_1 ra = rp_vector_of(a->relative), rb = rp_vector_of(b->relative), rc = rp_vector_of(c->relative);
    float distance;
    const uint hit = rp_distance_1(&edges, &ra, &rb, &rc, rp_vector_of(rp_permute(s->axis, ray->reciprocal)), 1u, &distance);
    return hit != 0u ? distance : -1.0f;
}

// Distance of the nearest hit in front of the origin, or -1. Haines, Guenther, Akenine-Moeller 2019, "Precision Improvements for
// Ray/Sphere Intersection" (Ray Tracing Gems, chapter 7).
static inline float rp_hit_sphere(const rp_ray* ray, float4 sphere) {
    const float3 f = ray->origin - sphere.xyz, d = ray->direction;
    const float a = dot(d, d), b = -dot(f, d), radius = sphere.w;
    const float3 l = f + (b / a) * d;
    const float discriminant = radius * radius - dot(l, l);
    if (!(discriminant >= 0.0f)) return -1.0f;
    const float c = dot(f, f) - radius * radius, q = b + copysign(sqrt(a * discriminant), b);
    const float t0 = c / q, t1 = q / a;
    const float first = rp_min(t0, t1), second = rp_max(t0, t1);
    const float t = first > 0.0f ? first : second;
    if (!(t > 0.0f)) return -1.0f;
    float distance;
    return rp_in_bounds_1(t, rp_vector_of(-radius - f), rp_vector_of(radius - f), rp_vector_of(ray->reciprocal), &distance) ? distance : -1.0f;
}

#endif
