// For tests: layered materials and metals outside a path, in a frame whose normal is z.
#define RP_LAYERED
#include "shading/layers.cl"

static inline rp_frame_1 rp_probe_frame(float4 view) {
    rp_frame_1 f;
    f.normal = f.geometric_normal = rp_vector_of((float3)(0.0f, 0.0f, 1.0f));
    f.tangent = rp_vector_of((float3)(1.0f, 0.0f, 0.0f));
    f.bitangent = rp_vector_of((float3)(0.0f, 1.0f, 0.0f));
    f.view = rp_vector_of(view.xyz);
    f.back_facing = view.w != 0.0f ? -1 : 0;
    return f;
}

static inline float3 rp_probe_color(const __global rp_material* m) { return (float3)(m->color[0], m->color[1], m->color[2]); }

// views: unit direction, and whether it is inside. numbers: of the lobe, and of the direction. results: direction, density (0: a single direction);
// weight, density of the side.
__kernel void rp_probe_sample_layers(const __global rp_material* m, const __global float4* views, const __global float4* numbers, uint count,
                                     __global float4* results) {
    const uint i = get_global_id(0);
    if (i >= count) return;
    const rp_frame_1 f = rp_probe_frame(views[i]);
    if (m->kind == RP_MATERIAL_CONDUCTOR) {
        const rp_scatter of_metal = rp_bsdf_sample(m, &f, (float4)(numbers[i].y, numbers[i].z, 0.0f, 0.0f));
        results[2u * i] = (float4)(of_metal.direction, of_metal.density);
        results[2u * i + 1u] = (float4)(of_metal.weight, 1.0f);
        return;
    }
    const rp_layers layers = rp_choose_layers(m, &f, rp_probe_color(m), numbers[i].x);
    const rp_scatter s = rp_layers_sample(m, &f, &layers, (float4)(numbers[i].y, numbers[i].z, 0.0f, 0.0f));
    results[2u * i] = (float4)(s.direction, s.density);
    results[2u * i + 1u] = (float4)(s.weight, layers.side);
}

// directions: unit. results: BSDF * cosine, and the density of sampling the direction.
__kernel void rp_probe_evaluate_layers(const __global rp_material* m, const __global float4* views, const __global float4* directions, uint count,
                                       __global float4* results) {
    const uint i = get_global_id(0);
    if (i >= count) return;
    const rp_frame_1 f = rp_probe_frame(views[i]);
    const bool below = directions[i].z < 0.0f;
    rp_layers layers = rp_choose_layers(m, &f, rp_probe_color(m), below ? 0x1.fffffep-1f : 0.0f);
    float density = 0.0f;
    float3 value = (float3)(0.0f);
    if (m->kind == RP_MATERIAL_CONDUCTOR) {
        value = rp_bsdf_evaluate(m, &f, directions[i].xyz, &density);
        results[i] = (float4)(value, density);
        return;
    }
    if (layers.below == below) value = rp_layers_evaluate(m, &f, &layers, directions[i].xyz, &density) * layers.side;
    results[i] = (float4)(value, density * layers.side);
}
