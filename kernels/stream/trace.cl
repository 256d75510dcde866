// Third stage on CPUs: does what single_ray/extend.cl and connect.cl do, with streams of rays. A work-item that finds no more extension rays goes on
// with shadow rays, so that cores wait for each other once.
#define RP_WITHOUT_KERNELS
#include "stream/extend.cl"
#include "stream/connect.cl"
#undef RP_WITHOUT_KERNELS

__kernel void rp_trace_stream(RP_GEOMETRY_PARAMETERS, const __global uchar* restrict wide_top, uint block_count, uint round, uint slot_count,
                              const __global uint* restrict queue, __global uint* restrict status, __global uint4* restrict planes,
                              volatile __global uint* restrict counters, __constant rp_render_params* restrict params,
                              const __global rp_primitive_range* restrict ranges, __global uint* restrict film) {
    const rp_geometry geometry = RP_MAKE_GEOMETRY(block_count);
    const rp_paths paths = {slot_count, status, planes};
    rp_extend_streams(&geometry, rp_share_of(counters[RP_COUNT_EXTEND]), wide_top, block_count, round, queue, demand, paths, counters);
    const rp_connect_scene scene = {params, ranges, film};
    rp_connect_streams(&geometry, rp_share_of(counters[RP_COUNT_SHADOW]), wide_top, block_count, round, queue, demand, paths, counters, scene);
}
