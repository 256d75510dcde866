// For tests: what probe.cl does, with streams; and parts of the stream traversal alone.
#include "stream/stream_slots.cl"
#include "stream/traverse.cl"
#include "common/waiting_lists.cl"
#include "stream/wide_surface.cl"

static inline void rp_trace_walk(const rp_geometry* geometry, rp_walk* walk, const __global uchar* wide_top, const bool any_hit) {
    rp_begin_walk(walk, wide_top);
    while (walk->rays != 0ul) rp_step(geometry, walk, 1u, any_hit);
}

static inline void rp_set_stream_ray(rp_stream* s, uint r, float3 origin, float3 direction, float t, uint primitive) {
    RP_SET_OF_RAY(s->origin[0], r, origin.x);
    RP_SET_OF_RAY(s->origin[1], r, origin.y);
    RP_SET_OF_RAY(s->origin[2], r, origin.z);
    RP_SET_OF_RAY(s->direction[0], r, direction.x);
    RP_SET_OF_RAY(s->direction[1], r, direction.y);
    RP_SET_OF_RAY(s->direction[2], r, direction.z);
    RP_SET_OF_RAY(s->t, r, t);
    ((uint*)s->primitive)[r] = primitive;
}

static inline void rp_load_probe_stream(const __global float4* rays, uint first, uint count, rp_stream* s) {
    for (uint r = 0u; r < RP_STREAM_RAYS; r++) {
        const uint i = first + min(r, count - 1u);
        rp_set_stream_ray(s, r, rays[2u * i].xyz, rays[2u * i + 1u].xyz, rays[2u * i].w, RP_NONE);
    }
    s->active = count < RP_STREAM_RAYS ? (1ul << count) - 1ul : ~0ul;
    rp_prepare_stream(s);
}

static inline void rp_load_probe_walk(const __global float4* rays, uint first, uint count, rp_walk* walk) {
    rp_load_probe_stream(rays, first, count, &walk->stream);
#ifdef RP_INSTANCES
    rp_begin_in_world(walk, 0, 0, 0ul);
#endif
}

// Rays and results as those of rp_probe, but that the block entry is RP_NONE, or 0 if the ray came to an absent block.
__kernel void rp_probe_stream(RP_GEOMETRY_PARAMETERS, const __global uchar* restrict wide_top, uint block_count, const __global float4* restrict rays,
                              uint count, __global uint4* restrict results) {
    const rp_geometry geometry = RP_MAKE_GEOMETRY(block_count);
    rp_walk walk;
    for (uint first = RP_STREAM_RAYS * (uint)get_global_id(0); first < count; first += RP_STREAM_RAYS * (uint)get_global_size(0)) {
        const uint n = min(count - first, RP_STREAM_RAYS);
        rp_load_probe_walk(rays, first, n, &walk);
        rp_trace_walk(&geometry, &walk, wide_top, false);
        rp_wide_surfaces surfaces;
#ifdef RP_INSTANCES
        rp_find_surfaces_in_world(&geometry, &walk.stream, &walk.inner, &surfaces);
#else
        rp_find_surfaces(&walk.stream, &surfaces);
#endif
        for (uint r = 0u; r < n; r++) {
            const bool hit = rp_hit_in_launch(&walk.stream, r);
#ifdef RP_PROBE_UVS
            const float3 position = (float3)(surfaces.texture[r].uv, surfaces.texture[r].density);
            const uint normal = surfaces.texture[r].tangent;
#else
            const float3 position = (float3)(surfaces.position[0][r], surfaces.position[1][r], surfaces.position[2][r]);
            const uint normal = surfaces.geometric_normal[r];
#endif
            results[2u * (first + r)] =
                (uint4)(as_uint(hit ? RP_OF_RAY(walk.stream.t, r) : INFINITY), ((const uint*)walk.stream.primitive)[r], hit ? normal : 0u, 0u);
            results[2u * (first + r) + 1u] = (uint4)(hit ? as_uint3(position) : (uint3)(0u), rp_waits_at(&walk.stream, r) == RP_NONE ? RP_NONE : 0u);
        }
        rp_load_probe_walk(rays, first, n, &walk);
        rp_trace_walk(&geometry, &walk, wide_top, true);
        for (uint r = 0u; r < n; r++)
            if (!(walk.stream.active >> r & 1ul)) ((__global uint*)(results + 2u * (first + r)))[3] = 1u;
    }
}

// For tests of the order in which rays wait. rays: as for rp_probe. before: block entry that the ray waits at (RP_NONE: it begins), unused, and its
// closest hit so far: t (or the ray's end), primitive. results: block entry that it waits at now, the distance at which it enters that (INFINITY:
// none), and its closest hit now.
__kernel void rp_probe_stream_waits(RP_GEOMETRY_PARAMETERS, const __global uchar* restrict wide_top, uint block_count,
                                    const __global float4* restrict rays, const __global uint4* restrict before, uint count,
                                    __global uint4* restrict results) {
    const rp_geometry geometry = RP_MAKE_GEOMETRY(block_count);
    rp_walk walk;
    rp_stream* s = &walk.stream;
    for (uint first = RP_STREAM_RAYS * (uint)get_global_id(0); first < count; first += RP_STREAM_RAYS * (uint)get_global_size(0)) {
        const uint n = min(count - first, RP_STREAM_RAYS);
        for (uint r = 0u; r < RP_STREAM_RAYS; r++) {
            const uint i = first + min(r, n - 1u);
            rp_set_stream_ray(s, r, rays[2u * i].xyz, rays[2u * i + 1u].xyz, as_float(before[i].z), before[i].w);
        }
        s->active = n < RP_STREAM_RAYS ? (1ul << n) - 1ul : ~0ul;
        rp_prepare_stream(s);
        for (uint r = 0u; r < n; r++)
            if (before[first + r].x != RP_NONE) rp_resume_ray(s, r, geometry.block_entries, before[first + r].x);
        rp_trace_walk(&geometry, &walk, wide_top, false);
        for (uint r = 0u; r < n; r++) {
            const uint block_entry = rp_waits_at(s, r);
            results[first + r] = (uint4)(block_entry, as_uint(block_entry == RP_NONE ? INFINITY : RP_OF_RAY(s->wait, r)), as_uint(RP_OF_RAY(s->t, r)),
                                         ((const uint*)s->primitive)[r]);
        }
    }
}

// For tests of the box arithmetic: node i against rays 64 i to 64 i + 63, in three ways: as many together as possible, one
// after the other, and each alone. met: 24 masks a node, eight a way, of the rays that meet child k.
// entry: of the same ways and children, the least distance at which a ray enters.
__kernel void rp_probe_wide_boxes(const __global float4* restrict rays, const __global rp_wide_node* restrict nodes, __global ulong* restrict met,
                                  __global float* restrict entry) {
    const uint i = get_global_id(0);
    rp_stream s;
    rp_load_probe_stream(rays, RP_STREAM_RAYS * i, RP_STREAM_RAYS, &s);
    rp_children_met children;
    rp_meet_children(&s, nodes + i, s.t, ~0ul, false, &children);
    rp_planes planes;
    rp_decode_planes(nodes + i, &planes);
    rp_children_met alone;
    rp_rays_meet(&s, &planes, s.t, ~0ul, nodes[i].count, false, &alone);
    rp_children_met single;
    for (uint k = 0u; k < RP_WIDE_CHILDREN; k++) {
        single.rays[k] = 0ul;
        single.entry[k] = INFINITY;
    }
    for (uint r = 0u; r < RP_STREAM_RAYS; r++) {
        rp_children_met of_ray;
        const uint met_by_ray = rp_meet_children(&s, nodes + i, s.t, 1ul << r, false, &of_ray);
        for (uint k = 0u; k < RP_WIDE_CHILDREN; k++) {
            if (!(met_by_ray >> k & 1u)) continue;
            single.rays[k] |= 1ul << r;
            single.entry[k] = rp_min(single.entry[k], of_ray.entry[k]);
        }
    }
    for (uint k = 0u; k < RP_WIDE_CHILDREN; k++) {
        met[24u * i + k] = children.rays[k];
        met[24u * i + 8u + k] = alone.rays[k];
        met[24u * i + 16u + k] = single.rays[k];
        entry[24u * i + k] = children.entry[k];
        entry[24u * i + 8u + k] = alone.entry[k];
        entry[24u * i + 16u + k] = single.entry[k];
    }
}

// For tests of vector.cl, which has portable and special forms: what its functions make of 16 numbers and 16 indices a work-item.
// results: mask of numbers > 0 in 16 and in 8 lanes, mask of the lanes of that mask, index of its lowest bit; then least and greatest
// number; then 16 picked numbers; the first eight numbers, each twice, picked as eight of 64 bits by the first eight indices modulo 8; the bits of
// the first eight, sorted; the first eight picked by the first eight indices modulo 8; all sixteen, picked by the first eight
// indices; and a matrix transposed, in row k of which are the first (k even) or last eight indices, each plus 64 k.
__kernel void rp_probe_vectors(const __global float* restrict numbers, const __global uint* restrict indices, __global uint* restrict results) {
    const uint i = get_global_id(0);
    const float16 v = vload16(i, numbers);
    const uint16 index = vload16(i, indices);
    __global uint* out = results + 126u * i;
    const uint mask = rp_mask16(v > 0.0f);
    out[0] = mask;
    out[1] = rp_mask8(v.lo > 0.0f);
    out[2] = rp_mask16(rp_lanes16(mask));
    out[3] = rp_lowest((ulong)mask | 1ul << 40);
    out[4] = as_uint(rp_least16(v));
    out[5] = as_uint(rp_greatest16(v));
#ifdef RP_AVX512
    vstore16(as_uint16(rp_pick16(v, index)), 0, out + 6);
#else
    vstore8(as_uint8(rp_pick_of_two8(v.lo, v.hi, index.lo)), 0, out + 6);
    vstore8(as_uint8(rp_pick_of_two8(v.lo, v.hi, index.hi)), 0, out + 14);
#endif
    const ulong8 twice = convert_ulong8(as_uint8(v.lo));
    vstore16(as_uint16(rp_pick_long8(twice | twice << 32, index.lo & 7u)), 0, out + 22);
    vstore8(rp_sort8(as_uint8(v.lo)), 0, out + 38);
    vstore8(as_uint8(rp_pick8(v.lo, index.lo)), 0, out + 46);
    vstore8(as_uint8(rp_pick_of_two8(v.lo, v.hi, index.lo)), 0, out + 54);
    uint8 rows[8];
    for (uint k = 0u; k < 8u; k++) rows[k] = (k & 1u ? index.hi : index.lo) + 64u * k;
    rp_transpose8(rows);
    for (uint k = 0u; k < 8u; k++) vstore8(rows[k], k, out + 62);
}

// For tests of how rays come to wait: each work-item has a stream of RP_STREAM_RAYS slots, those behind the ones of the work-items before it, and
// blocks[i] is what the ray of slot i waits for. All streams have the same number, so they meet in the same lists.
__kernel void rp_probe_chains(const __global uint* restrict blocks, uint block_count, uint slot_count, uint shadow, __global uint* restrict status,
                              volatile __global uint* restrict demand) {
    const uint first = RP_STREAM_RAYS * (uint)get_global_id(0);
    const rp_paths paths = {slot_count, status, 0};
    rp_pending_lists lists;
    rp_begin_pending_lists(&lists, 3u, shadow != 0u);
    for (uint r = 0u; r < RP_STREAM_RAYS; r++)
        rp_wait_for_block_in_list(&lists, &paths, first + r, blocks[first + r], rp_extension_waits(0u, 0u), demand, block_count);
    rp_end_pending_lists(&lists, &paths, demand, block_count);
}
