// A part of surface.cl: surfaces of objects, where instances put them. Without fused operations, as those are.

static inline float3 rp_cross_unfused(float3 a, float3 b) {
    return (float3)(rp_add(rp_mul(a.y, b.z), -rp_mul(a.z, b.y)), rp_add(rp_mul(a.z, b.x), -rp_mul(a.x, b.z)),
                    rp_add(rp_mul(a.x, b.y), -rp_mul(a.y, b.x)));
}
static inline float3 rp_sum3(float3 a, float3 b, float3 c) { return rp_sum(rp_sum(a, b), c); }
// A direction of any length, as a code that says something.
static inline uint rp_encode_direction(float3 v) {
    const float largest = rp_largest(v);
    if (!(largest > 0.0f && largest <= FLT_MAX)) return rp_encode_normal((float3)(0.0f, 0.0f, 1.0f));
    const uint code = rp_encode_normal(rp_scaled(as_float(0x7f000000u - (as_uint(largest) & 0x7f800000u)), v));
    return code == RP_NONE ? 0x0000ffffu : code;  // the neighbouring code
}

// base: of the object. ref: of what was hit there. coordinate: what the position in the object is rounded as; returns the same of the position
// outside.
static inline float rp_move_to_world(const __global rp_instance* instance, float3 base, uint ref, float coordinate, rp_surface* s) {
    // The rows lead into the object; the columns of their inverse, times its determinant, lead back.
    const float3 x = rp_load3(instance->to_object), y = rp_load3(instance->to_object + 3), z = rp_load3(instance->to_object + 6);
    const float3 back_x = rp_cross_unfused(y, z), back_y = rp_cross_unfused(z, x), back_z = rp_cross_unfused(x, y);
    const float determinant = rp_add(rp_add(rp_mul(x.x, back_x.x), rp_mul(x.y, back_x.y)), rp_mul(x.z, back_x.z)),
                inverse = rp_div(1.0f, determinant);
    const float3 center = rp_load3(instance->center), from_base = s->position - base;
    const float3 part_x = rp_scaled(rp_mul(from_base.x, inverse), back_x), part_y = rp_scaled(rp_mul(from_base.y, inverse), back_y);
    const float3 part_z = rp_scaled(rp_mul(from_base.z, inverse), back_z);
    // Position and base are rounded as their coordinates in the object are.
    const float scaled = rp_mul(coordinate + rp_largest(base), fabs(inverse));
    const float largest = rp_largest(center) + rp_largest(part_x) + rp_largest(part_y) + rp_largest(part_z) +
                          rp_mul(scaled, rp_largest(back_x) + rp_largest(back_y) + rp_largest(back_z));
    s->position = rp_sum(center, rp_sum3(part_x, part_y, part_z));
    s->offset_exponent = rp_offset_exponent_1(largest);

    const float3 n = rp_decode_normal(s->geometric_normal);
    const float3 normal = rp_sum3(rp_scaled(n.x, x), rp_scaled(n.y, y), rp_scaled(n.z, z));
    const uint code = rp_encode_direction(normal);
#ifndef RP_ONLY_TRIANGLES
    const bool is_point = (ref & (RP_LEAF_SPHERES | RP_LEAF_POINTS)) == (RP_LEAF_SPHERES | RP_LEAF_POINTS);
#else
    const bool is_point = false;
#endif
    if (!is_point && s->shading_normal != s->geometric_normal) {
        const float3 m = rp_decode_normal(s->shading_normal);
        s->shading_normal = rp_encode_direction(rp_sum3(rp_scaled(m.x, x), rp_scaled(m.y, y), rp_scaled(m.z, z)));
    } else if (!is_point) {
        s->shading_normal = code;
    }
    s->geometric_normal = code;
#ifdef RP_UVS
    // An area grows by what the normal does, over the determinant.
    const float grows = rp_mul(rp_sqrt(rp_squared_length(normal)), fabs(inverse)), density = rp_div(s->density, rp_sqrt(grows));
    s->density = grows > 0.0f && density <= FLT_MAX ? density : 0.0f;
#ifdef RP_TANGENTS
    if (s->tangent != RP_NONE) {
        const float3 t = rp_decode_normal(s->tangent);
        const float sign = inverse < 0.0f ? -1.0f : 1.0f;
        s->tangent = rp_encode_direction(
            rp_sum3(rp_scaled(rp_mul(sign, t.x), back_x), rp_scaled(rp_mul(sign, t.y), back_y), rp_scaled(rp_mul(sign, t.z), back_z)));
    }
#endif
#endif
    return largest;
}

// Of a hit that was found by the ray in the world, which may be in an instance.
static inline rp_surface rp_surface_in_world(const rp_geometry* g, float3 origin, float3 direction, const rp_hit* hit) {
    if (!hit->instance) {
        const rp_ray ray = rp_make_ray(origin, direction);
        return rp_hit_surface(g, &ray, hit);
    }
#if RP_INSTANCE_LEVELS > 1
    const uint depth = rp_instance_depth(&hit->chain);
    const rp_placed_ray placed = rp_place_ray_in_chain(g->objects, &hit->chain, depth, origin, direction);
    const rp_ray ray = rp_make_ray(placed.origin, placed.direction);
    const float start = placed.start;
#else
    const float3 base = rp_load3(g->objects[hit->instance->object].base);
    const rp_ray ray = rp_ray_inside(hit->instance, hit->number, base, origin, direction);
    const float start = ray.start;
#endif
    rp_hit in_object = *hit;
    in_object.t = rp_add(hit->t, -start);
    rp_surface s = rp_hit_surface(g, &ray, &in_object);
#if RP_INSTANCE_LEVELS > 1
    float coordinate = rp_largest(s.position);
    for (uint i = depth; i-- > 0u;) {
        const __global rp_instance* const instance = hit->chain.instance[i];
        coordinate = rp_move_to_world(instance, rp_base_of(g->objects, instance), hit->what, coordinate, &s);
    }
#else
    rp_move_to_world(hit->instance, base, hit->what, rp_largest(s.position), &s);
#endif
    return s;
}
