// Rays against triangles and spheres: exact positions, one test for every device and traversal.
//
// Triangles: Woop, Benthin, Wald 2013, "Watertight Ray/Triangle Intersection", in single precision with unfused products, so that two
// triangles see their shared edge with exactly opposite signs and no ray slips between. On top of that the result does not depend on the
// order in which a strip lists the three vertices (rp_sum3), so that it is the same however the scene was cut into blocks.
#ifndef RP_PRIMITIVE_CL
#define RP_PRIMITIVE_CL

#include "common/box.cl"

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

// The distance of a hit on a primitive with the bounds [low, high] (relative to the ray's origin, permuted), or -1 if they say that it is none. t
// is wrong by rounding, on long thin triangles by much more than positions are. It is moved to where the ray is within the bounds: or boxes
// around them would decide, by the order of visits, what is hit, and rays would pass through faces that they begin before. Bounds that end
// behind the origin are not hit at all, which boxes around them may have seen or not.
static inline float rp_in_bounds(float t, float3 low, float3 high, float3 reciprocal) {
    const float3 a = low * reciprocal, b = high * reciprocal;
    const float entry = rp_max(rp_max(rp_min(a.x, b.x), rp_min(a.y, b.y)), rp_min(a.z, b.z));
    const float leave = rp_min(rp_min(rp_max(a.x, b.x), rp_max(a.y, b.y)), rp_max(a.z, b.z));
    // By rounding a ray may miss the bounds of what it hits: then they end before they begin.
    const float moved = rp_min(rp_max(t, rp_min(entry, leave)), rp_max(entry, leave));
    return leave > 0.0f && moved > 0.0f && t == t ? moved : -1.0f;
}

// a * b - c * d, the area on one side of an edge: 0, or of the right sign.
static inline float rp_edge_function(float a, float b, float c, float d) { return rp_mul(a, b) - rp_mul(c, d); }
// The same where both products round to the same number: the difference of what rounding took from them, which is exact but for one
// rounding (Dekker 1971; fma gives the rounding error of a product).
static inline float rp_edge_remainder(float a, float b, float c, float d) {
    const float ab = rp_mul(a, b), cd = rp_mul(c, d);
    return fma(a, b, -ab) - fma(c, d, -cd);
}
// Whether one of them is below 0 and one above, looked up in their bits: those of numbers below 0 are above those of -0, as unsigned integers.
static inline bool rp_signs_differ(float u, float v, float w) {
    return max(max(as_uint(u), as_uint(v)), as_uint(w)) > 0x80000000u && max(max(as_int(u), as_int(v)), as_int(w)) > 0;
}

// Whether the ray's line may hit a triangle: false only where the test below says so by signs.
static inline bool rp_may_hit_triangle(const rp_sheared* a, const rp_sheared* b, const rp_sheared* c) {
    return !rp_signs_differ(rp_edge_function(c->x, b->y, c->y, b->x), rp_edge_function(a->x, c->y, a->y, c->x),
                            rp_edge_function(b->x, a->y, b->y, a->x));
}

// Distance of the hit, or -1. Edges and vertices belong to all triangles that share them.
static inline float rp_hit_triangle(const rp_ray* ray, const rp_shear* s, const rp_sheared* a, const rp_sheared* b, const rp_sheared* c) {
    float u = rp_edge_function(c->x, b->y, c->y, b->x), v = rp_edge_function(a->x, c->y, a->y, c->x), w = rp_edge_function(b->x, a->y, b->y, a->x);
    if (rp_signs_differ(u, v, w)) return -1.0f;
    if (u == 0.0f || v == 0.0f || w == 0.0f) {
        // Rounding is monotone, so an edge function never has the wrong sign, but it may have come out as 0 and passed for an edge.
        if (u == 0.0f) u = rp_edge_remainder(c->x, b->y, c->y, b->x);
        if (v == 0.0f) v = rp_edge_remainder(a->x, c->y, a->y, c->x);
        if (w == 0.0f) w = rp_edge_remainder(b->x, a->y, b->y, a->x);
        if (rp_signs_differ(u, v, w)) return -1.0f;
    }
    const float determinant = rp_sum3(u, v, w);
    if (determinant == 0.0f) return -1.0f;
    const float3 reciprocal = rp_permute(s->axis, ray->reciprocal);
    const float az = rp_mul(a->relative.z, reciprocal.z), bz = rp_mul(b->relative.z, reciprocal.z), cz = rp_mul(c->relative.z, reciprocal.z);
    const float t = rp_sum3(rp_mul(u, az), rp_mul(v, bz), rp_mul(w, cz)) / determinant;
    const float3 lower = fmin(fmin(a->relative, b->relative), c->relative), upper = fmax(fmax(a->relative, b->relative), c->relative);
    return rp_in_bounds(t, lower, upper, reciprocal);
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
    return rp_in_bounds(t, -radius - f, radius - f, ray->reciprocal);
}

#endif
