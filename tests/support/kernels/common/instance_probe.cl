// For tests: rays into instances. rays: origin xyz, unused; direction xyz, unused. placed: origin xyz, start; direction xyz, 0.
#include "common/instance.cl"

__kernel void rp_probe_instances(const __global rp_instance* restrict instances, const __global float4* restrict bases,
                                 const __global float4* restrict rays, uint count, __global float4* restrict placed) {
    const uint i = get_global_id(0);
    if (i >= count) return;
    const rp_placed_ray ray = rp_place_ray(instances + i, bases[i].xyz, rays[2u * i].xyz, rays[2u * i + 1u].xyz);
    placed[2u * i] = (float4)(ray.origin, ray.start);
    placed[2u * i + 1u] = (float4)(ray.direction, 0.0f);
}
